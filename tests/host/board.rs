//! `greyrig board` without its program.

use std::process::Command;

#[test]
fn a_board_that_is_not_built_says_how_to_build_it() {
    // A copy of the tool in a folder of its own, without a path: the program cannot be found.
    let folder = tempfile::tempdir().unwrap();
    let tool = folder.path().join("greyrig");
    std::fs::copy(env!("CARGO_BIN_EXE_greyrig"), &tool).unwrap();
    let output = Command::new(&tool).args(["board", "--json"]).env("PATH", folder.path()).output().unwrap();
    let talk = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), talk.lines().count()), (Some(2), 1), "{talk}");
    assert!(talk.contains("not built") && talk.contains("--package greyrig-board"), "{talk}");
}
