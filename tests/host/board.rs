//! `greyrig board` without its program.

use std::process::Command;

#[test]
fn a_board_that_is_not_built_says_how_to_build_it() {
    // The tool in a folder of its own, without a path: the program cannot be found. Linked, as a copy is open for
    // writing for a moment, and processes that other tests start meanwhile keep it so: "text file busy".
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let tool = folder.path().join("greyrig");
    std::fs::hard_link(env!("CARGO_BIN_EXE_greyrig"), &tool).unwrap();
    let output = Command::new(&tool).args(["board", "--json"]).env("PATH", folder.path()).output().unwrap();
    let talk = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), talk.lines().count()), (Some(2), 1), "{talk}");
    assert!(talk.contains("not built") && talk.contains("--package greyrig-board"), "{talk}");

    let help = Command::new(&tool).args(["board", "--help"]).env("PATH", folder.path()).output().unwrap();
    let text = String::from_utf8(help.stdout).unwrap();
    assert!(
        help.status.success() && text.contains("Usage: greyrig board") && text.contains("--package greyrig-board"),
        "{text}"
    );
}
