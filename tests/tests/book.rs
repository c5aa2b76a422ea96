//! The book: every command in it runs, every link leads somewhere, every page is in its summary.

#![cfg(unix)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The pages with their texts.
fn pages() -> Vec<(PathBuf, String)> {
    let folder = root().join("docs/book/src");
    let mut pages: Vec<_> = fs::read_dir(&folder)
        .expect("the book is there")
        .map(|entry| entry.expect("it can be read").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
        .map(|path| {
            let text = fs::read_to_string(&path).expect("a page is text");
            (path, text)
        })
        .collect();
    pages.sort();
    assert!(pages.len() > 8, "{}", pages.len());
    pages
}

/// Lines of the blocks marked `sh`: what is to be run. Blocks marked `console` need hardware or run for ever.
fn commands(text: &str) -> Vec<String> {
    let mut commands = Vec::new();
    let mut block = None;
    for line in text.lines() {
        match (line.trim_start().strip_prefix("```"), block) {
            (Some(kind), None) => block = Some(kind == "sh"),
            (Some(_), Some(_)) => block = None,
            (None, Some(true)) if !line.trim().is_empty() => commands.push(line.trim().to_owned()),
            _ => {}
        }
    }
    commands
}

#[test]
fn every_command_runs_and_ends_as_the_book_says() {
    // What a reader writes goes into a folder of its own; what he reads lies where the book says, in the project.
    let scratch = std::env::temp_dir().join(format!("film-feed-book-{}", std::process::id()));
    fs::create_dir_all(&scratch).expect("a scratch directory can be made");
    for part in ["docs", "lenze9300-model"] {
        std::os::unix::fs::symlink(
            root().join(part).canonicalize().expect("it is there"),
            scratch.join(part),
        )
        .expect("a link can be made");
    }
    let mut run = 0;
    // In the order of the summary, for one command may read what another has written.
    let summary = fs::read_to_string(root().join("docs/book/src/SUMMARY.md")).expect("the summary is text");
    for page in links(&summary) {
        let text = fs::read_to_string(root().join("docs/book/src").join(&page)).expect("a page is text");
        for line in commands(&text) {
            let (command, remark) = line.split_once('#').unwrap_or((&line, ""));
            let expected = i32::from(remark.contains("exit code 1"));
            let mut words = command.split_whitespace();
            let program = match words.next() {
                Some("film-feed") => env!("CARGO_BIN_EXE_film-feed-under-test"),
                Some("lenze9300") => env!("CARGO_BIN_EXE_lenze9300-under-test"),
                other => panic!("{page}: {other:?} is no program of ours; mark the block `console`"),
            };
            let output = Command::new(program)
                .args(words)
                .current_dir(&scratch)
                .stdin(Stdio::null())
                .output()
                .expect("the program starts");
            assert_eq!(
                output.status.code(),
                Some(expected),
                "{page}: {line}\n{}{}",
                String::from_utf8_lossy(&output.stdout),
                String::from_utf8_lossy(&output.stderr)
            );
            run += 1;
        }
    }
    assert!(run > 15, "{run}");
    fs::remove_dir_all(&scratch).expect("it goes again");
}

/// Targets of the links and pictures of a page, without those to other places.
fn links(text: &str) -> Vec<String> {
    text.split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')').map(|(target, _)| target.to_owned()))
        .filter(|target| !target.starts_with("http"))
        .collect()
}

#[test]
fn every_link_leads_somewhere_and_every_page_is_in_the_summary() {
    let mut linked = BTreeSet::new();
    for (path, text) in pages() {
        let folder = path.parent().expect("a page lies in a folder");
        for target in links(&text) {
            let file = target.split('#').next().unwrap_or_default();
            assert!(folder.join(file).is_file(), "{}: {target}", path.display());
            if path.ends_with("SUMMARY.md") {
                linked.insert(file.to_owned());
            }
        }
        for included in text.split("{{#include ").skip(1) {
            let file = included.split("}}").next().unwrap_or_default();
            assert!(folder.join(file).is_file(), "{}: {file}", path.display());
        }
    }
    for (path, _) in pages() {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        assert!(
            name == "SUMMARY.md" || linked.contains(name),
            "{name} is not in the summary"
        );
    }
}

#[test]
fn a_picture_of_every_view_is_in_the_book() {
    let panel = fs::read_to_string(root().join("docs/book/src/panel.md")).expect("a page is text");
    for view in ["machine", "variables", "scope", "drive", "parameters", "bus"] {
        assert!(panel.contains(&format!("(pictures/{view}.png)")), "{view}");
    }
}
