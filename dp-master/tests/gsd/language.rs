//! The language of GSD files, a test for each rule: how statements are written, and what is said about those that are not.
//!
//! Expected values: guideline "Specification for PROFIBUS Device Description and Device Integration, Volume 1: GSD", and files of large makers
//! where these go beyond it.

#![cfg(feature = "std")]

use dp_master::gsd::{self, MainFamily, Severity};

use crate::bench::{SLAVE, clean, complaints, remarks, with};

#[test]
fn there_is_nothing_to_say_about_the_smallest_slave() {
    let gsd = clean("");
    assert_eq!(gsd.general.ident_number, Some(0x1234));
    assert_eq!(gsd.modules.len(), 1);
}

#[test]
fn keywords_are_read_in_any_case() {
    let gsd = clean(
        "fReEZE_mODE_SUPP = 1\nprmtext = 1\ntext(0) = \"a\"\nENDPRMTEXT\nextuserprmdata = 1 \"p\"\nBIT(3) 0\nprm_text_ref = 1\nendextuserprmdata\next_user_prm_data_ref(0) = 1\n",
    );
    assert!(gsd.slave.freeze_mode_supp);
    assert_eq!(gsd.prm_texts[&1].texts[&0], "a");
    assert_eq!(gsd.prm.places[0].reference, 1);
}

#[test]
fn blanks_and_tabs_may_stand_between_all_parts_of_a_statement_or_be_left_out() {
    for statement in [
        "Diag_Update_Delay=9",
        "  \tDiag_Update_Delay\t =\t\t9   ",
        "Diag_Update_Delay = 9;comment",
        "Diag_Update_Delay = 9 ; comment",
    ] {
        assert_eq!(clean(statement).slave.diag_update_delay, Some(9), "{statement}");
    }
    let gsd = clean("Unit_Diag_Bit ( 7 )=\"x\"");
    assert_eq!(gsd.unit_diag.bits[&7].text, "x");
}

#[test]
fn lines_may_end_in_every_way_and_the_last_one_may_not_end_at_all() {
    let text = format!("{SLAVE}Diag_Update_Delay = 9\nJokerblock_Slot = 8");
    for end in ["\n", "\r\n", "\r"] {
        let reading = gsd::parse(text.replace('\n', end).as_bytes());
        assert_eq!(remarks(&reading), [""; 0]);
        assert_eq!(reading.gsd.slave.diag_update_delay, Some(9));
        assert_eq!(reading.gsd.slave.jokerblock_slot, Some(8));
    }
}

#[test]
fn lines_are_counted_the_same_with_every_line_end() {
    for end in ["\n", "\r\n", "\r"] {
        let reading = gsd::parse(format!("{SLAVE}\n\nFoo = 1\n").replace('\n', end).as_bytes());
        assert_eq!(remarks(&reading), ["warning 25: unknown keyword `Foo`"]);
    }
}

#[test]
fn a_line_goes_on_behind_a_backslash() {
    let gsd = clean("Ext_User_Prm_Data_Const(0) = 1, \\\n 2,\\\n\\\n3 \\\n,4");
    assert_eq!(gsd.prm.constants[0].octets, [1, 2, 3, 4]);
}

#[test]
fn a_comment_may_follow_the_backslash() {
    // As in motor starters of a large maker.
    let gsd = clean("Ext_User_Prm_Data_Const(0) = 0x80,0x00,0x08,\\    ;*** status\n0xD4,0x81 ;*** header\n");
    assert_eq!(gsd.prm.constants[0].octets, [0x80, 0, 8, 0xD4, 0x81]);
}

#[test]
fn a_text_may_go_on_in_the_next_line() {
    let gsd = clean("Info_Text = \"Motor starter, \\\nwith bus\"");
    assert_eq!(gsd.general.info_text.unwrap(), "Motor starter, with bus");
}

#[test]
fn a_remark_names_the_line_and_column_where_the_statement_really_stands() {
    let reading = with("User_Prm_Data_Len = 2\nUser_Prm_Data = 1, \\\n\\\n    300");
    let remark = &reading.diagnostics[0];
    assert_eq!((remark.at.line, remark.at.column), (22 + 4, 5));
    assert_eq!(
        remark.to_string(),
        "line 26: `User_Prm_Data`: expected a number from 0 to 255, got 300"
    );
}

#[test]
fn a_semicolon_and_everything_else_may_stand_in_a_text() {
    let gsd = clean("Info_Text = \"a;b=c,(d)-@#\\e\" ; comment");
    assert_eq!(gsd.general.info_text.unwrap(), "a;b=c,(d)-@#\\e");
}

#[test]
fn blanks_at_the_end_of_a_text_are_dropped_those_at_its_start_are_kept() {
    // Makers fill texts up to 32 characters, and indent names.
    let gsd = clean("Info_Text = \"  a b                         \"");
    assert_eq!(gsd.general.info_text.unwrap(), "  a b");
}

#[test]
fn a_long_line_costs_no_more_than_its_length() {
    // Each of these took minutes when something looked back to the start of the line, or ahead to its end, at every step.
    let count = 300_000;
    for (head, piece) in [
        ("Info_Text = \"", "a\"b"),
        ("Info_Text = ", "\"\" 1 "),
        ("Info_Text = \"", "\"  "),
        ("Module = \"m\" 0", ",300"),
        ("Slave_Family = 1", "@a"),
        ("ExtUserPrmData = 1 \"p\"\nUnsigned8 0 1-2", ",5-3"),
        ("ExtUserPrmData = 1 \"p\"\nUnsigned8 0 1-2", ",1-2"),
        ("", "(="),
        ("", "\\\n"),
        ("Foo", "\\ ; x\n"),
    ] {
        let reading = gsd::parse(format!("{SLAVE}{head}{}", piece.repeat(count)).as_bytes());
        assert!(reading.diagnostics.len() <= 3, "{head}{piece}");
    }
    // Many short lines, each with something to say.
    let reading = gsd::parse(format!("{SLAVE}{}", "Text(0) = \"a\n".repeat(count / 10)).as_bytes());
    assert_eq!(reading.diagnostics.len(), 1_001);
}

#[test]
fn quotation_marks_inside_a_text_are_kept_and_told() {
    assert_eq!(
        complaints("Info_Text = \"say \"stop\" twice\""),
        ["warning 1: the text has quotation marks inside"]
    );
    let reading = with("Module = \"12\" pipe\" 0x10,0x20\nEndModule");
    assert_eq!(reading.gsd.modules[1].name, "12\" pipe");
    assert_eq!(reading.gsd.modules[1].config, [0x10, 0x20]);
}

#[test]
fn a_text_without_end_ends_with_its_line() {
    assert_eq!(
        complaints("Info_Text = \"no end\nFreeze_Mode_supp = 1"),
        ["error 1: the text has no quotation mark at its end"]
    );
    assert!(
        with("Info_Text = \"no end\nFreeze_Mode_supp = 1")
            .gsd
            .slave
            .freeze_mode_supp
    );
}

#[test]
fn a_word_behind_a_text_is_no_part_of_it_but_an_error() {
    let reading = with("OrderNumber = \"4711\" xyz");
    assert_eq!(reading.gsd.general.order_number, None);
    assert_eq!(reading.diagnostics.len(), 1, "{:?}", reading.diagnostics);
}

#[test]
fn a_text_that_is_too_long_is_kept_and_told() {
    assert_eq!(complaints(&format!("OrderNumber = \"{}\"", "x".repeat(32))), [""; 0]);
    let text = "x".repeat(33);
    assert_eq!(
        complaints(&format!("OrderNumber = \"{text}\"")),
        ["warning 1: the text has 33 characters, 32 are allowed"]
    );
    assert_eq!(
        with(&format!("OrderNumber = \"{text}\"")).gsd.general.order_number,
        Some(text)
    );
}

#[test]
fn numbers_are_decimal_with_leading_zeros_or_hexadecimal() {
    for (written, value) in [("10", 10), ("010", 10), ("0x10", 16), ("0X1f", 31), ("0x0000001F", 31)] {
        assert_eq!(
            clean(&format!("Diag_Update_Delay = {written}")).slave.diag_update_delay,
            Some(value),
            "{written}"
        );
    }
}

#[test]
fn what_is_no_number_or_out_of_range_is_told_with_what_is_allowed() {
    for (written, got) in [
        ("256", "256"),
        ("abc", "`abc`"),
        ("0xG", "`0xG`"),
        ("-1", "`-`"),
        ("99999999999999999999", "`99999999999999999999`"),
        ("\"1\"", "`\"1\"`"),
        ("", "the end of the line"),
    ] {
        assert_eq!(
            complaints(&format!("Diag_Update_Delay = {written}")),
            [format!(
                "error 1: `Diag_Update_Delay`: expected a number from 0 to 255, got {got}"
            )],
        );
    }
    assert_eq!(
        complaints("Max_Diag_Data_Len = 5"),
        [
            "warning 1: `Max_Diag_Data_Len` stands already in line 14, the last one counts",
            "error 1: `Max_Diag_Data_Len`: expected a number from 6 to 244, got 5"
        ]
    );
}

#[test]
fn something_behind_a_value_is_told() {
    assert_eq!(
        complaints("Diag_Update_Delay = 9 8"),
        ["error 1: `Diag_Update_Delay`: expected nothing more in this line, got `8`"]
    );
    assert_eq!(
        complaints("EndModule"),
        ["error 1: `EndModule` closes nothing, there is no `Module` before it"]
    );
    assert_eq!(
        complaints("Module = \"m\" 0x10\nEndModule 5"),
        ["error 2: `EndModule`: expected nothing more in this line, got `5`"]
    );
}

#[test]
fn a_statement_without_equals_sign_or_keyword_is_told() {
    assert_eq!(
        complaints("Diag_Update_Delay 9"),
        ["error 1: `Diag_Update_Delay`: expected `=`, got `9`"]
    );
    assert_eq!(complaints("Foo 9"), ["warning 1: unknown keyword `Foo 9`"]);
    assert_eq!(complaints("= 9"), ["error 1: expected a keyword, got `=`"]);
    assert_eq!(complaints("\"text\""), ["error 1: expected a keyword, got `\"text\"`"]);
    assert_eq!(complaints("17"), ["error 1: expected a keyword, got `17`"]);
}

#[test]
fn an_index_must_be_where_it_belongs() {
    assert_eq!(
        complaints("Unit_Diag_Bit = \"x\""),
        ["error 1: `Unit_Diag_Bit` needs an index in parentheses"]
    );
    assert_eq!(
        complaints("Diag_Update_Delay(1) = 2"),
        ["error 1: `Diag_Update_Delay` has no index in parentheses"]
    );
    assert_eq!(
        complaints("Unit_Diag_Bit(2000) = \"x\""),
        ["error 1: `Unit_Diag_Bit`: expected a number from 0 to 1895, got 2000"]
    );
    assert_eq!(
        complaints("Unit_Diag_Bit(1 2) = \"x\""),
        ["error 1: `Unit_Diag_Bit`: expected nothing more in this line, got `2`"]
    );
}

#[test]
fn lists_of_octets_are_separated_by_commas() {
    assert_eq!(
        complaints("Ext_User_Prm_Data_Const(0) = 1 2"),
        ["error 1: `Ext_User_Prm_Data_Const`: expected `,`, got `2`"]
    );
    assert_eq!(
        complaints("Ext_User_Prm_Data_Const(0) = 1,2,"),
        ["error 1: `Ext_User_Prm_Data_Const`: expected a number from 0 to 255, got the end of the line"]
    );
}

#[test]
fn everything_before_the_marker_is_ignored() {
    let reading = gsd::parse(format!("This = is any \"text\n; and a comment\n{SLAVE}").as_bytes());
    assert_eq!(remarks(&reading), [""; 0]);
}

#[test]
fn a_file_without_marker_is_read_all_the_same() {
    let reading = gsd::parse(SLAVE.strip_prefix("#Profibus_DP\n").unwrap().as_bytes());
    assert_eq!(
        remarks(&reading),
        ["error 1: the line `#Profibus_DP` is missing, so the whole file is read as a description"]
    );
    assert_eq!(reading.gsd.general.ident_number, Some(0x1234));
}

#[test]
fn sections_of_other_kinds_are_kept_as_they_are() {
    let gsd = clean("#Vendor_Tool\nDiag_Update_Delay = 9\nany text (1\n#PROFIBUS_dp\nDiag_Update_Delay = 8");
    assert_eq!(gsd.sections.len(), 1);
    assert_eq!(gsd.sections[0].name, "Vendor_Tool");
    assert_eq!(gsd.sections[0].statements, ["Diag_Update_Delay = 9", "any text (1"]);
    assert_eq!(gsd.slave.diag_update_delay, Some(8));
}

#[test]
fn unknown_keywords_are_kept_by_name_with_their_value() {
    let reading = with("X_Vendor_Foo(3) = 1, \"two\" ; comment\nModule = \"m\" 0x10\nBar\nEndModule");
    assert_eq!(
        remarks(&reading),
        [
            "warning 23: unknown keyword `X_Vendor_Foo`",
            "warning 25: unknown keyword `Bar` in `Module`"
        ]
    );
    let [foo, bar] = &reading.gsd.other[..] else { panic!() };
    assert_eq!((foo.block.as_deref(), foo.keyword.as_str()), (None, "X_Vendor_Foo(3)"));
    assert_eq!(foo.value.as_deref(), Some("1, \"two\""));
    assert_eq!((bar.block.as_deref(), bar.keyword.as_str()), (Some("Module"), "Bar"));
    assert_eq!((bar.value.as_deref(), bar.at.line), (None, 25));
}

#[test]
fn a_keyword_given_twice_is_told_and_the_last_one_counts() {
    let reading = with("Model_Name = \"other\"");
    assert_eq!(
        remarks(&reading),
        ["warning 23: `Model_Name` stands already in line 4, the last one counts"]
    );
    assert_eq!(reading.gsd.general.model_name.as_deref(), Some("other"));
    assert_eq!(
        complaints("Unit_Diag_Bit(1) = \"a\"\nUnit_Diag_Bit(2) = \"b\"\nUNIT_DIAG_BIT(1) = \"c\""),
        ["warning 3: `UNIT_DIAG_BIT(1)` stands already in line 23, the last one counts"]
    );
}

#[test]
fn octets_of_windows_1252_and_of_utf_8_are_characters() {
    let latin = [
        SLAVE.as_bytes(),
        b"Info_Text = \"Antriebsregler f\xFCr 5 \x80, 90\xB0\"",
    ]
    .concat();
    assert_eq!(
        gsd::parse(&latin).gsd.general.info_text.unwrap(),
        "Antriebsregler für 5 €, 90°"
    );
    let utf_8 = format!("\u{FEFF}{SLAVE}Info_Text = \"für 5 €\"");
    let reading = gsd::parse(utf_8.as_bytes());
    assert_eq!(remarks(&reading), [""; 0]);
    assert_eq!(reading.gsd.general.info_text.unwrap(), "für 5 €");
}

#[test]
fn nothing_behind_the_end_of_file_character_is_read() {
    let reading = gsd::parse(format!("{SLAVE}\u{1A}garbage = (\n").as_bytes());
    assert_eq!(remarks(&reading), [""; 0]);
}

#[test]
fn the_slave_family_has_names_of_sub_families_without_quotation_marks() {
    // As an AS-i link and a motor starter write it.
    let family = |written: &str| {
        let text = SLAVE.replace("Slave_Family = 0", &format!("Slave_Family = {written}"));
        let reading = gsd::parse(text.as_bytes());
        assert_eq!(remarks(&reading), [""; 0], "{written}");
        reading.gsd.slave.slave_family.unwrap()
    };
    assert_eq!(family("9@AS-I").main, MainFamily::Gateway);
    assert_eq!(family("9@AS-I").sub, ["AS-I"]);
    assert_eq!(
        family("2@SIRIUS@Motor starter (C);comment").sub,
        ["SIRIUS", "Motor starter (C)"]
    );
    assert_eq!(family("1 @ Lenze ").sub, ["Lenze"]);
    assert_eq!(family("12").main, MainFamily::Pa);
}

#[test]
fn remarks_come_in_the_order_of_the_file_and_end_at_a_thousand() {
    let reading = with(&"Foo\n".repeat(1_500));
    assert_eq!(reading.diagnostics.len(), 1_001);
    assert!(reading.diagnostics.is_sorted_by_key(|remark| remark.at));
    let last = reading.diagnostics.last().unwrap();
    assert_eq!(last.severity, Severity::Error);
    assert_eq!(last.message, "500 more errors and warnings are left out");
}
