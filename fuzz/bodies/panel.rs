//! The panel's machine and what its pages say, a line each: the first character is the page, `+` behind it comes, `-` goes, nothing lets a
//! frame pass, and anything else is said by the page.

use std::collections::BTreeMap;
use std::time::Duration;

use film_feed::operator::FeedPlan;
use film_feed::panel::HandTurned;
use film_feed::panel::protocol::{INPUTS, MAX_ORDER};
use film_feed::rig::RigConfig;
use serde_json::Value;

const FRAME: Duration = Duration::from_millis(5);
const PAGES: u64 = 4;

/// What a page knows.
#[derive(Default)]
struct Page {
    has_control: bool,
    seq: Option<u64>,
    refusals: usize,
}

pub(crate) fn run(data: &[u8]) {
    let mut panel = HandTurned::new(RigConfig::default(), &FeedPlan::default()).unwrap();
    let mut pages: BTreeMap<u64, Page> = BTreeMap::new();
    for line in data.split(|octet| *octet == b'\n').take(60) {
        let Some((page, said)) = line.split_first() else {
            continue;
        };
        let page = u64::from(*page) % PAGES;
        match said {
            b"+" => {
                pages.insert(page, Page::default());
                panel.join(page);
            }
            b"-" => {
                pages.remove(&page);
                panel.leave(page);
            }
            // The server takes no longer ones.
            said if said.len() <= MAX_ORDER && pages.contains_key(&page) => {
                if let Ok(said) = std::str::from_utf8(said) {
                    say(&mut panel, &mut pages, page, said);
                }
            }
            _ => {}
        }
        panel.turn(FRAME);
        hear(&mut panel, &mut pages);
    }
    // Whatever they did, the machine goes on for the next one.
    for page in 0..PAGES {
        panel.leave(page);
    }
    panel.join(PAGES);
    panel.say(PAGES, r#"{"do":"speed","factor":1}"#).unwrap();
    let mut times = Vec::new();
    for _ in 0..10 {
        panel.turn(Duration::from_millis(10));
        times.extend(
            panel
                .heard(PAGES)
                .iter()
                .filter_map(|text| read(text)["time_s"].as_f64()),
        );
    }
    assert_eq!(times.len(), 10, "a frame for each turn");
    assert!(
        times.is_sorted() && times[9] > times[0],
        "the machine stands: {times:?}"
    );
}

fn say(panel: &mut HandTurned, pages: &mut BTreeMap<u64, Page>, page: u64, said: &str) {
    let before = pages[&page].refusals;
    let may = pages[&page].has_control;
    let Ok(()) = panel.say(page, said) else {
        return;
    };
    hear(panel, pages);
    // What changes something is refused to who has not the control.
    let order = read(said);
    // An array with the name in front is an order, too.
    let name = order.get("do").or_else(|| order.get(0)).and_then(Value::as_str);
    let looks = name.is_some_and(|name| ["take_control", "release_control", "read_code"].contains(&name));
    if !may && !looks {
        assert_eq!(
            pages[&page].refusals,
            before + 1,
            "{said} was taken from a page without control"
        );
    }
}

fn read(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn hear(panel: &mut HandTurned, pages: &mut BTreeMap<u64, Page>) {
    for (number, page) in pages.iter_mut() {
        for text in panel.heard(*number) {
            let told = read(&text);
            match told["t"].as_str().unwrap() {
                "frame" => {
                    let seq = told["seq"].as_u64().unwrap();
                    assert!(
                        page.seq.is_none_or(|last| seq == last + 1),
                        "frame {seq} follows {:?}",
                        page.seq
                    );
                    page.seq = Some(seq);
                    let inputs = told["inputs"].as_array().unwrap();
                    assert_eq!(inputs.len(), INPUTS.len());
                    for (info, value) in INPUTS.iter().zip(inputs) {
                        let value = value.as_i64().unwrap();
                        assert!(
                            (info.min.into()..=info.max.into()).contains(&value),
                            "{} = {value}",
                            info.name
                        );
                    }
                    let factor = told["factor"].as_f64().unwrap();
                    assert!((0.0..=100.0).contains(&factor), "{factor}");
                }
                "control" => page.has_control = told["yours"].as_bool().unwrap(),
                "refused" => {
                    assert!(!told["why"].as_str().unwrap().is_empty());
                    page.refusals += 1;
                }
                "hello" | "code" | "done" => {}
                other => panic!("a page was told {other}"),
            }
        }
    }
    let holders = pages.values().filter(|page| page.has_control).count();
    assert!(holders <= 1, "{holders} pages have the control");
}
