//! The files that people write, as any text: machine, catalogue, traversing program, parameters.

use film_feed::catalogue::Catalogue;
use film_feed::machine_file::MachineFile;
use lenze9300_model::FileError;
use lenze9300_model::code::{CodeStore, read_parameter_file, read_parameter_settings, write_parameter_file};
use lenze9300_model::traverse::ProgramFile;

/// The first octet chooses the kind of file, the rest is its text.
pub(crate) fn run(data: &[u8]) {
    let Some((kind, text)) = data.split_first() else {
        return;
    };
    let Ok(text) = std::str::from_utf8(text) else {
        return;
    };
    match kind % 4 {
        0 => check(text, MachineFile::read(text, &Catalogue::built_in())),
        1 => check(text, Catalogue::read(text)),
        2 => check(text, ProgramFile::read(text, &CodeStore::factory())),
        _ => parameters(text),
    }
}

/// Every mistake has a line of the file and a text, and they stand in the order of the lines.
fn check<T>(text: &str, read: Result<T, FileError>) {
    let Err(error) = read else {
        return;
    };
    assert!(!error.mistakes.is_empty());
    let lines = 1 + text.bytes().filter(|octet| *octet == b'\n').count();
    let mut before = 1;
    for mistake in &error.mistakes {
        assert!((before..=lines).contains(&mistake.line), "{mistake}: of {lines} lines");
        assert!(!mistake.what.is_empty());
        before = mistake.line;
    }
}

/// What was read can be written and reads the same; a file with a mistake changes nothing.
fn parameters(text: &str) {
    check(text, read_parameter_settings(text));
    let base = CodeStore::factory();
    let mut codes = base.clone();
    let read = read_parameter_file(text, &mut codes);
    let was_read = read.is_ok();
    check(text, read);
    let written = write_parameter_file(&codes, &base);
    if !was_read {
        assert_eq!(
            written,
            write_parameter_file(&base, &base),
            "a file with mistakes changed something"
        );
        return;
    }
    let mut again = base.clone();
    let reread = read_parameter_file(&written, &mut again);
    assert_eq!(reread, Ok(()), "what was written is not readable: {written}");
    assert_eq!(write_parameter_file(&again, &base), written);
}
