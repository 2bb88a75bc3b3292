//! `cargo xtask size`: what the firmware takes, and what must hold for that.

use std::process::Stdio;

use crate::cargo::{cargo_command, not_started};
use crate::firmware::elf::Image;
use crate::firmware::report::{Program, Stack};
use crate::needs::{self, Need};

/// Memory of the STM32G474RE that the linker may use (`memory.x`): begin and length.
const RAM: (u32, u32) = (0x2000_0000, 96 * 1024);
/// Length of the program's part of the flash.
const FLASH: u32 = 256 * 1024;

/// What happens once a test, with its first sample.
const BEGIN: &str = "greyrig::app::fresh::begin";

/// A firmware image.
struct Board {
    name: &'static str,
    /// Alias of the command that builds it.
    build: &'static str,
    /// Handler of the sampling interrupt.
    handler: &'static str,
    /// What of that may lie in flash: fragments of names.
    exempt: &'static [&'static str],
    /// Where its flash begins.
    flash: u32,
    /// Where the code of the interrupt runs: begin and length.
    hot: (u32, u32),
    /// Most flash that it may take, so that nobody makes it much larger unawares, bytes.
    most_flash: u32,
    /// Most stack, likewise.
    most_stack: u32,
}

const BOARDS: [Board; 2] = [
    Board {
        name: "NUCLEO-G474RE",
        build: "fw",
        handler: "ADC1_2",
        exempt: &[BEGIN],
        flash: 0x0800_0000,
        hot: (0x1000_0000, 32 * 1024),
        most_flash: 200_000,
        most_stack: 47_000,
    },
    Board {
        name: "mps2-an386",
        build: "fw-qemu",
        handler: "SysTick",
        // The motor in place of the converter is no part of a tick.
        exempt: &[BEGIN, "greyrig::app::bench::"],
        flash: 0,
        hot: (0x2010_0000, 32 * 1024),
        most_flash: 200_000,
        most_stack: 47_000,
    },
];

/// What is known about an image.
struct Figures {
    sections: [u32; 6],
    /// Functions that the sampling interrupt can reach.
    reached: usize,
    stack: Stack,
    /// What is left of the RAM for the stack.
    room: u32,
}

/// Prints the tables of the images and of the instructions that a sample takes, having provided what that needs.
///
/// # Errors
/// The first thing that does not hold.
pub fn tables() -> Result<(), String> {
    needs::provide([Need::Target, Need::Qemu].iter())?;
    images()?;
    instructions()
}

/// Builds and checks all images and prints their table.
///
/// # Errors
/// The first thing that does not hold.
pub fn images() -> Result<(), String> {
    println!("| image | .hot | .warm | .text | .rodata | .data | .bss | stack at most | room for it |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let mut notes = Vec::new();
    for board in &BOARDS {
        let bytes = built(board)?;
        let figures = figures(board, &bytes).map_err(|sentence| format!("{}: {sentence}", board.name))?;
        let [hot, warm, text, rodata, data, bss] = figures.sections;
        let (bound, room) = (figures.stack.bound(), figures.room);
        println!("| {} | {hot} | {warm} | {text} | {rodata} | {data} | {bss} | {bound} | {room} |", board.name);
        let deepest: Vec<String> =
            figures.stack.handlers.iter().map(|(handler, bytes)| format!("{handler} {bytes}")).collect();
        notes.push(format!(
            "{}: the sampling interrupt {} reaches {} functions, none of which can panic; stack of the program {}, of {}",
            board.name,
            board.handler,
            figures.reached,
            figures.stack.thread,
            deepest.join(", ")
        ));
    }
    println!();
    notes.iter().for_each(|note| println!("{note}."));
    Ok(())
}

fn figures(board: &Board, bytes: &[u8]) -> Result<Figures, String> {
    let image = Image::parse(bytes)?;
    let (ram_begin, ram_length) = RAM;
    let within = |begin: u32, length: u32, at: u32, size: u32| at >= begin && at + size <= begin + length;
    for (name, address, size) in &image.sections {
        let fits = within(board.flash, FLASH, *address, *size)
            || within(board.hot.0, board.hot.1, *address, *size)
            || within(ram_begin, ram_length, *address, *size);
        if !fits {
            return Err(format!("{name} at {address:#x} lies outside flash and RAM"));
        }
    }
    if image.section(".vector_table").map(|(address, _)| address) != Some(board.flash) {
        return Err("the vector table does not stand at the begin of the flash".into());
    }
    let handler = image.symbol(board.handler).unwrap_or_default();
    if !within(board.hot.0, board.hot.1, handler, 1) {
        return Err(format!("{} at {handler:#x} is not among the hot code", board.handler));
    }
    let size = |name| image.section(name).map_or(0, |(_, length)| length);
    let flash = size(".vector_table") + size(".hot") + size(".warm") + size(".text") + size(".rodata") + size(".data");
    if flash > board.most_flash {
        return Err(format!("it takes {flash} bytes of flash, more than {}", board.most_flash));
    }
    let program = Program::new(&image);
    let reached = program.check_no_panic(board.handler)?;
    // What waits for the flash takes a time that depends on its cache.
    let slow = program.within(board.handler, board.exempt, &(board.flash..board.flash + FLASH));
    if !slow.is_empty() {
        return Err(format!("{} reaches what lies in flash, see src/bin/hot.x: {}", board.handler, slow.join(", ")));
    }
    let stack = program.stack()?;
    // Below the stack's room there is no memory (`memory.x`).
    let symbol = |name| image.symbol(name).ok_or_else(|| format!("there is no symbol {name}"));
    let (stack_begin, stack_end) = (symbol("_stack_start")?, symbol("_stack_end")?);
    if stack_end != ram_begin {
        return Err(format!("the stack may grow to {stack_end:#x}, below which there is memory"));
    }
    let room = stack_begin - stack_end;
    let bound = stack.bound();
    if bound > room.min(board.most_stack) {
        return Err(format!("the stack can take {bound} bytes; {room} are free, {} allowed", board.most_stack));
    }
    let bss = size(".bss") + size(".uninit");
    Ok(Figures {
        sections: [size(".hot"), size(".warm"), size(".text"), size(".rodata"), size(".data"), bss],
        reached,
        stack,
        room,
    })
}

/// Builds an image and reads it.
fn built(board: &Board) -> Result<Vec<u8>, String> {
    let mut command = cargo_command(&[board.build, "--locked", "--message-format", "json-render-diagnostics"]);
    let output = command.stderr(Stdio::inherit()).output().map_err(|error| not_started(&command, &error))?;
    if !output.status.success() {
        return Err(format!("cargo {} ended with {}", board.build, output.status));
    }
    let messages = String::from_utf8_lossy(&output.stdout);
    let path = messages.split("\"executable\":\"").nth(1).and_then(|rest| rest.split('"').next());
    let path = path.ok_or("cargo does not name the executable")?;
    std::fs::read(path).map_err(|error| format!("{path} cannot be read: {error}"))
}

/// Prints the instructions that a sample takes, as the emulator counts them.
fn instructions() -> Result<(), String> {
    let arguments =
        ["test", "--release", "--quiet", "--locked", "--package", "greyrig-target-tests", "--", "--nocapture"];
    let mut command = cargo_command(&arguments);
    let output = command.stderr(Stdio::inherit()).output().map_err(|error| not_started(&command, &error))?;
    if !output.status.success() {
        return Err(format!("the emulated core: {}", String::from_utf8_lossy(&output.stdout)));
    }
    println!();
    for line in String::from_utf8_lossy(&output.stdout).lines().filter(|line| line.starts_with('|')) {
        println!("{line}");
    }
    Ok(())
}
