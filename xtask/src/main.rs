//! Chores of the repository: `cargo xtask test` runs every check, having provided what the checks need; `cargo xtask
//! exam` examines the diagnosis on blind cases, `cargo xtask lot` the detector on a virtual production lot; `cargo
//! xtask size` prints what the firmware takes; `cargo xtask python` builds and tests the Python package; `cargo xtask
//! fuzz` looks for inputs that anything that reads bytes cannot stand, `cargo xtask mutants` finds what no test
//! notices, and `cargo xtask semver` what breaks users.

mod book;
mod cargo;
mod checks;
mod dependencies;
mod firmware;
mod fuzz;
mod mutation;
mod needs;
mod new_effect;
mod packages;
mod page;
mod python;
mod semver;
mod size;
mod structure;
mod tally;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.split_first() {
        Some((first, rest)) if first == "--help" || (first == "test" && rest == ["--help"]) => {
            print!("{}", usage());
            ExitCode::SUCCESS
        }
        Some((command, wanted)) if command == "test" => match checks::choose(wanted) {
            Ok((chosen, length)) => checks::run(&chosen, length),
            Err(sentence) => {
                eprintln!("xtask: {sentence}");
                ExitCode::from(2)
            }
        },
        Some((command, [])) if command == "size" => ended(size::tables()),
        Some((command, [])) if command == "book" => checks::book(),
        Some((command, [name])) if command == "new-effect" => {
            let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
            ended(new_effect::make(&root, name).map(|made| print!("{}", new_effect::told(name, &made))))
        }
        Some((command, arguments)) if command == "fuzz" => fuzz::run(arguments),
        Some((command, arguments)) if command == "mutants" => ended(mutation::run(arguments)),
        Some((command, [revision])) if command == "semver" => ended(semver::run(revision)),
        Some((command, arguments)) if command == "python" => checks::python(arguments),
        Some((command, arguments)) if command == "exam" => checks::exam("greyrig-exam", arguments),
        Some((command, arguments)) if command == "lot" => checks::exam("greyrig-lot", arguments),
        _ => {
            eprint!("{}", usage());
            ExitCode::from(2)
        }
    }
}

fn ended(result: Result<(), String>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(sentence) => {
            eprintln!("xtask: {sentence}");
            ExitCode::FAILURE
        }
    }
}

fn usage() -> String {
    let mark = |check: &checks::Check| if checks::BY_NAME.contains(&check.name) { " (when named)" } else { "" };
    let steps: String =
        checks::ALL.iter().map(|check| format!("  {:12} {}{}\n", check.name, check.what, mark(check))).collect();
    format!(
        "Usage: cargo xtask exam [OPTION]…   (--help shows them)\n       cargo xtask lot [OPTION]…\n       cargo xtask size\n       \
         cargo xtask book   (the documentation, into the folder book)\n       cargo xtask new-effect NAME   (the beginning of an effect: file, line, test, page)\n       cargo xtask python [OPTION]…   (the Python package; options are pytest's)\n       \
         cargo xtask mutants [PACKAGE] [--file PART-OF-PATH]… [--shard K/N] [--again] [--output DIR]\n       cargo xtask semver REVISION\n       \
         cargo xtask fuzz [--seconds N] [--seed N] [TARGET]…   (N seconds for each target)\n       \
         cargo xtask test [{long}] [STEP]…\n\nWithout a step, all of them in this order:\n\n{steps}\n\
         {long}: tests that have a long version run it: a minute of sampling on the virtual board instead of ten seconds.\n",
        long = checks::LONG
    )
}
