//! Licences of everything this project builds on, against the list in `deny.toml`.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Names between the quotes of the list `allow` of `deny.toml`.
fn allowed(text: &str) -> Vec<&str> {
    let list = text.split("allow = [").nth(1).and_then(|rest| rest.split(']').next());
    list.unwrap_or_default().split('"').skip(1).step_by(2).collect()
}

/// Whether an SPDX expression can be met with these licences alone: `AND` needs both sides, `OR` one. A `/` is an old `OR`.
fn is_met(expression: &str, allowed: &[&str]) -> bool {
    let expression = expression.replace('/', " OR ");
    let without_parentheses = expression.replace(['(', ')'], "");
    // In the expressions of crates AND binds a parenthesis to a licence, or licences to each other: both are split first.
    without_parentheses
        .split(" AND ")
        .all(|part| part.split(" OR ").any(|licence| allowed.contains(&licence.trim())))
}

/// What cargo knows of all crates: those of every platform, or of this one alone where the others cannot be fetched.
fn metadata(root: &Path) -> Value {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let run = |arguments: &[&str]| {
        let mut command = Command::new(&cargo);
        command.args(arguments).current_dir(root);
        command.output().expect("cargo starts")
    };
    let every_platform = run(&["metadata", "--format-version", "1"]);
    let output = if every_platform.status.success() {
        every_platform
    } else {
        let version = String::from_utf8(run(&["-vV"]).stdout).expect("text");
        let host = version.lines().find_map(|line| line.strip_prefix("host: "));
        let host = host.expect("cargo names its platform");
        run(&[
            "metadata",
            "--format-version",
            "1",
            "--offline",
            "--filter-platform",
            host,
        ])
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("metadata is JSON")
}

#[test]
fn every_dependency_has_a_licence_that_is_allowed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let text = std::fs::read_to_string(root.join("deny.toml")).expect("the list is there");
    let allowed = allowed(&text);
    assert!(allowed.contains(&"MIT") && allowed.contains(&"MPL-2.0"), "{allowed:?}");
    let metadata = metadata(&root);
    let packages = metadata["packages"].as_array().expect("a list");
    assert!(packages.len() > 100, "{}", packages.len());
    let refused: Vec<_> = packages
        .iter()
        .filter(|package| !is_met(package["license"].as_str().unwrap_or("none"), &allowed))
        .map(|package| format!("{}: {}", package["name"], package["license"]))
        .collect();
    assert!(refused.is_empty(), "{refused:#?}");
}

#[test]
fn expressions_are_read_as_spdx_says() {
    let allowed = ["MIT", "Apache-2.0", "Unicode-3.0"];
    for (expression, met) in [
        ("MIT", true),
        ("MIT OR GPL-3.0-only", true),
        ("MIT/Apache-2.0", true),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", true),
        ("MIT AND GPL-3.0-only", false),
        ("GPL-3.0-only", false),
        ("none", false),
    ] {
        assert_eq!(is_met(expression, &allowed), met, "{expression}");
    }
}
