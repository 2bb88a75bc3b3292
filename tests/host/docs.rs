//! What the documentation says that commands print is what they print.
//!
//! - Blocks that begin with ` ```console checked ` hold commands, `$ greyrig …`, each with its output. They run in a
//!   folder of the page's own that holds the tutorial's recordings. After a command may stand `| head -N`, `| tail -N`,
//!   `| grep 'TEXT'` or `| sed -n '/^TEXT/,$p'`, which are done here.
//! - Pages that a command writes are compared with what it writes.
//!
//! With `GREYRIG_BLESS=1` the pages are written anew instead.

use std::path::{Path, PathBuf};
use std::process::Command;

use greyrig_host::context::Context;
use greyrig_host::handbook;

/// The width of the tables in the pages.
const COLUMNS: &str = "80";

/// How far two figures may lie apart that two machines print, relative: both compute the same to many digits, and the
/// last of the two or three that are shown may be rounded another way. Small ones, as probabilities, keep their power.
const APART: f64 = 0.02;

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs")
}

fn blesses() -> bool {
    std::env::var_os("GREYRIG_BLESS").is_some()
}

/// The Markdown files of the documentation, the front page included.
fn pages() -> Vec<PathBuf> {
    let mut pages = vec![docs().join("../README.md")];
    let mut folders = vec![docs()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                pages.push(path);
            }
        }
    }
    pages.sort();
    pages
}

/// What a line of a page prints, with what stands after its bars done.
fn printed(line: &str, folder: &Path) -> Vec<String> {
    let words = shlex::split(line).unwrap_or_else(|| panic!("`{line}` is no command"));
    let mut stages = words.split(|word| word == "|");
    let command = stages.next().expect("a command");
    assert_eq!(command.first().map(String::as_str), Some("greyrig"), "`{line}`: commands of greyrig are checked");
    let output = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .args(&command[1..])
        .current_dir(folder)
        .env("COLUMNS", COLUMNS)
        .env_remove("GREYRIG_BLESS")
        .output()
        .expect("it runs");
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8_lossy(&text).trim_end().to_owned();
    let mut lines: Vec<String> = text.lines().map(|line| line.trim_end().to_owned()).collect();
    for stage in stages {
        let stage: Vec<&str> = stage.iter().map(String::as_str).collect();
        let count = |n: &str| n.trim_start_matches('-').parse::<usize>().unwrap_or_else(|_| panic!("`{line}`: {n}"));
        lines = match stage[..] {
            ["head", n] => lines.into_iter().take(count(n)).collect(),
            ["tail", n] => lines.split_off(lines.len().saturating_sub(count(n))),
            ["grep", text] => lines.into_iter().filter(|line| line.contains(text)).collect(),
            ["sed", "-n", script] => {
                let text = script.strip_prefix("/^").and_then(|rest| rest.strip_suffix("/,$p"));
                let text = text.unwrap_or_else(|| panic!("`{line}`: {script}"));
                lines.into_iter().skip_while(|line| !line.starts_with(text)).collect()
            }
            _ => panic!("`{line}`: {stage:?} is not known here"),
        };
    }
    lines
}

/// Whether two words are the same, or figures that are as good as the same.
fn alike(a: &str, b: &str) -> bool {
    let bare = |word: &str| word.trim_matches(|c: char| "(),;:%+".contains(c)).parse::<f64>().ok();
    // Rules and bars are as long as their columns are wide.
    let is_drawn = |word: &str| !word.is_empty() && word.chars().all(|c| "─│┌┐└┘├┤═╞╡█".contains(c));
    match (bare(a), bare(b)) {
        (Some(x), Some(y)) => (x - y).abs() <= APART * x.abs().max(y.abs()),
        _ => a == b || (is_drawn(a) && is_drawn(b)),
    }
}

fn same(expected: &[String], got: &[String]) -> bool {
    let of_a_line = |(a, b): (&String, &String)| {
        let (a, b): (Vec<&str>, Vec<&str>) = (a.split_whitespace().collect(), b.split_whitespace().collect());
        a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| alike(a, b))
    };
    expected.len() == got.len() && expected.iter().zip(got).all(of_a_line)
}

/// A page with the outputs of its checked blocks, and what differs from those that it holds.
fn checked(text: &str, folder: &Path) -> (String, Vec<String>) {
    let (mut page, mut faults) = (String::new(), Vec::new());
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        page += &format!("{line}\n");
        if line != "```console checked" {
            continue;
        }
        while let Some(command) = lines.next_if(|line| *line != "```") {
            let Some(asked) = command.strip_prefix("$ ") else {
                panic!("a checked block begins with a command, not with `{command}`");
            };
            let mut expected = Vec::new();
            while let Some(line) = lines.next_if(|line| *line != "```" && !line.starts_with("$ ")) {
                expected.push(line.to_owned());
            }
            let got = printed(asked, folder);
            if !same(&expected, &got) {
                faults.push(format!("$ {asked}\nin the page:\n{}\nprinted:\n{}", expected.join("\n"), got.join("\n")));
            }
            page += &format!("{command}\n");
            for line in got {
                page += &format!("{line}\n");
            }
        }
    }
    (page, faults)
}

#[test]
fn commands_print_what_the_pages_show() {
    let mut faults = Vec::new();
    let mut blocks = 0;
    for path in pages() {
        let text = std::fs::read_to_string(&path).expect("a page");
        if !text.contains("\n```console checked\n") {
            continue;
        }
        blocks += text.matches("\n```console checked\n").count();
        let folder = tempfile::tempdir().expect("a folder");
        for entry in std::fs::read_dir(docs().join("tutorial")).expect("the tutorial's recordings") {
            let recording = entry.expect("an entry").path();
            std::fs::copy(&recording, folder.path().join(recording.file_name().expect("a name"))).expect("a copy");
        }
        let (page, differing) = checked(&text, folder.path());
        if blesses() {
            std::fs::write(&path, page).expect("the page is written");
        } else {
            faults.extend(differing.iter().map(|it| format!("{}:\n{it}", path.display())));
        }
    }
    assert!(blocks >= 6, "the tutorial alone has that many: {blocks}");
    assert!(faults.is_empty(), "GREYRIG_BLESS=1 writes the pages anew\n\n{}", faults.join("\n\n"));
}

#[test]
fn a_page_that_shows_something_else_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = "```console checked\n$ greyrig effects saturation | head -1\nsaturation – something else\n```\n";
    let (mended, faults) = checked(page, folder.path());
    assert_eq!(faults.len(), 1);
    assert!(faults[0].contains("something else") && faults[0].contains("saturation of the main flux"), "{}", faults[0]);
    assert_eq!(checked(&mended, folder.path()), (mended.clone(), Vec::new()));
}

#[test]
fn figures_may_differ_in_their_last_digit_and_words_may_not() {
    let line = |text: &str| vec![text.to_owned()];
    assert!(same(&line("R  2.207 ohm  ────"), &line("R 2.208 ohm ──────")));
    assert!(same(&line("(0.99,"), &line("(1.00,")));
    assert!(!same(&line("R 2.2 ohm"), &line("R 2.4 ohm")));
    assert!(!same(&line("current 0.1 %"), &line("speed 0.1 %")));
    assert!(!same(&line("a b"), &line("a")));
}

/// Each effect has its page and, where the rig has the effect, its figure; there is no other file beside them.
#[test]
fn the_pages_of_the_effects_are_those_that_the_command_writes() {
    let folder = docs().join("effects");
    let mut names: Vec<String> = Vec::new();
    for d in greyrig::effects::Description::all() {
        assert!(![d.why, d.noticed, d.remedy].contains(&""), "{} lacks words for its page", d.id);
        for file in handbook::files(d, &Context::quiet()).expect("pages") {
            let path = folder.join(&file.name);
            if blesses() {
                std::fs::write(&path, &file.text).expect("the page is written");
            }
            let stored = std::fs::read_to_string(&path).unwrap_or_default();
            assert!(stored == file.text, "{}: run greyrig effects --book docs/effects --force", file.name);
            names.push(file.name);
        }
    }
    let mut stored: Vec<String> = std::fs::read_dir(&folder)
        .expect("the pages")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    stored.sort();
    names.sort();
    assert_eq!(stored, names);
}

/// Commands that take a moment, in the order in which they need each other's files. The sixth answer is an error.
const ANSWERED: &[&str] = &[
    "identify staircase.parquet --out model.toml",
    "check staircase.parquet ramp.parquet",
    "compare ramp.parquet --model model.toml",
    "diagnose staircase.parquet ramp.parquet --model model.toml",
    "add saturation --model model.toml staircase.parquet ramp.parquet --out model2.toml",
    "compare no-such-file.csv --model model.toml",
    "predict ramp.parquet --model model2.toml --out series.csv --band 95",
    "effects",
    "plan --model model.toml --rivals hysteresis,eddy_current",
    "simulate --profile steady --seconds 3 --seed 1 --spread 0.02 --out one.csv",
    "simulate --profile steady --seconds 3 --seed 2 --spread 0.02 --out two.csv",
    "simulate --profile steady --seconds 3 --seed 3 --spread 0.02 --out three.csv",
    "simulate --profile steady --seconds 3 --seed 4 --spread 0.02 --out four.csv",
    "calibrate one.csv two.csv three.csv four.csv --model model2.toml --out station.toml --what-would-be-seen",
    "monitor one.csv two.csv --model station.toml",
    "master one.csv --model station.toml --history golden.csv",
    "convert ramp.parquet --out ramp.csv",
    "train staircase.parquet ramp.parquet --model model2.toml --out hybrid.toml",
    "flash --model model2.toml --image flash.bin",
    "ports",
    "store add motors ramp.parquet",
    "store ls motors",
    "store run motors identify",
    "store check motors",
];

#[test]
fn what_commands_print_as_json_is_what_the_schema_says() {
    let schema: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(docs().join("json-schema.json")).expect("the schema")).unwrap();
    let validator = jsonschema::validator_for(&schema).expect("a schema");
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["staircase.parquet", "ramp.parquet"] {
        std::fs::copy(docs().join("tutorial").join(name), folder.path().join(name)).expect("a copy");
    }
    for line in ANSWERED {
        let output = Command::new(env!("CARGO_BIN_EXE_greyrig"))
            .args(line.split(' '))
            .arg("--json")
            .current_dir(folder.path())
            .output()
            .expect("it runs");
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|error| panic!("{line}: {error}: {}", String::from_utf8_lossy(&output.stderr)));
        let is_refused = line.contains("no-such-file");
        assert_eq!(answer.get("error").is_some(), is_refused, "{line}: {answer}");
        let faults: Vec<String> =
            validator.iter_errors(&answer).map(|error| format!("{}: {error}", error.instance_path())).collect();
        assert!(faults.is_empty(), "{line}:\n{}", faults.join("\n"));
        // The schema can refuse: each field of the answer's own that it requires is missed.
        let command = answer["command"].as_str().expect("a command").replace(' ', "_");
        let required = schema["$defs"][format!("answer_{command}")]["required"].as_array();
        if is_refused {
            continue;
        }
        for field in required.unwrap_or_else(|| panic!("the schema lacks {command}")) {
            let mut without = answer.clone();
            without.as_object_mut().expect("an object").remove(field.as_str().expect("a name"));
            assert!(!validator.is_valid(&without), "{line} without {field}");
        }
    }
}

/// What all commands say of themselves, each with its own subcommands behind it.
fn reference() -> String {
    let help = |words: &[String]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_greyrig"));
        let output = command.args(words).arg("--help").env("COLUMNS", "100").output().expect("it runs");
        String::from_utf8(output.stdout).expect("text")
    };
    let mut page = String::from(
        "# Commands\n\nWhat `greyrig COMMAND --help` says, of a build with all features. Which one does what: \
         [which command do I need?](which-command.md).\n",
    );
    let mut open = vec![Vec::new()];
    while let Some(words) = open.pop() {
        let text = help(&words);
        let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
        let title = [&["greyrig".to_owned()], words.as_slice()].concat().join(" ");
        page += &format!("\n## {title}\n\n```text\n{}\n```\n", lines.join("\n").trim_end());
        let listed = lines.iter().skip_while(|line| **line != "Commands:").skip(1).take_while(|line| !line.is_empty());
        let names = listed.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
        let names: Vec<&str> = names.filter_map(|line| line.split_whitespace().next()).collect();
        // The virtual board is a program of its own, which may not be built.
        for name in names.into_iter().rev().filter(|name| !["help", "board"].contains(name)) {
            open.push([words.as_slice(), &[name.to_owned()]].concat());
        }
    }
    page
}

#[test]
#[cfg(all(feature = "parquet", feature = "arrow", feature = "probe"))]
fn the_reference_of_the_commands_is_their_help() {
    let path = docs().join("commands.md");
    let page = reference();
    if blesses() {
        std::fs::write(&path, &page).expect("the page is written");
    }
    let stored = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(stored == page, "GREYRIG_BLESS=1 writes docs/commands.md anew");
}
