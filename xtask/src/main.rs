//! Chores of the repository: `cargo xtask test` runs every check, having provided what the checks need; `cargo xtask exam`
//! examines the diagnosis on blind cases, `cargo xtask lot` the detector on a virtual production lot; `cargo xtask size` prints
//! what the firmware takes.

mod checks;
mod firmware;
mod needs;
mod size;
mod tally;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.split_first() {
        Some((command, names)) if command == "test" => match checks::choose(names) {
            Ok(chosen) => checks::run(&chosen),
            Err(sentence) => {
                eprintln!("xtask: {sentence}");
                ExitCode::from(2)
            }
        },
        Some((command, [])) if command == "size" => match size::run(true) {
            Ok(()) => ExitCode::SUCCESS,
            Err(sentence) => {
                eprintln!("xtask: {sentence}");
                ExitCode::FAILURE
            }
        },
        Some((command, arguments)) if command == "exam" => checks::exam("greyrig-exam", arguments),
        Some((command, arguments)) if command == "lot" => checks::exam("greyrig-lot", arguments),
        _ => {
            eprintln!("Usage: cargo xtask exam [OPTION]…   (--help shows them)\n       cargo xtask lot [OPTION]…");
            eprintln!("       cargo xtask size\n       cargo xtask test [STEP]…\n");
            eprintln!("Without a step, all of them in this order:\n");
            for check in checks::ALL {
                eprintln!("  {:8} {}", check.name, check.what);
            }
            ExitCode::from(2)
        }
    }
}
