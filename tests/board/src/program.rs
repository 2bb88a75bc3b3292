//! The program: arguments, real time, and what goes to and from the terminal.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Parser;
use greyrig::units::CalibrationSettings;
use greyrig_board::controller::{Controller, Seen};
use greyrig_board::machine::Pace;
use greyrig_board::peripherals::flash::{BANK_LENGTH, Contents};
use greyrig_board::rig::Rig;
use greyrig_board::terminal::Terminal;
use greyrig_board::{Board, Image};
use greyrig_host::device::clock;
use greyrig_host::error::{EXIT_BAD_INPUT, EXIT_HARDWARE};
use greyrig_host::rig::{Kind, Motor, Setup};

/// A virtual NUCLEO-G474RE that runs the firmware as it is flashed, with the virtual rig at its pins, behind a
/// pseudo-terminal.
#[derive(Debug, Parser)]
#[command(
    name = "greyrig board",
    bin_name = "greyrig board",
    version,
    after_help = "Example:\n  cargo fw\n  greyrig board --fault sparking=0.3@5 --calibration-out rig.toml\n\n\
        It prints the name of a port for `greyrig flash`, `record` and `monitor`, and runs until Ctrl-C."
)]
struct Args {
    /// The firmware; by default what `cargo fw` has built
    #[arg(long, value_name = "ELF")]
    image: Option<PathBuf>,
    /// Kind of motor
    #[arg(long, value_enum, default_value = "universal")]
    kind: Kind,
    /// An effect beyond the base model, with its size if not the usual one; may be repeated
    #[arg(long = "effect", value_name = "ID[:FORM][=SIZE]")]
    effects: Vec<String>,
    /// A fault, with its size and the time of its onset in seconds after the start of the processor; may be repeated
    #[arg(long = "fault", value_name = "ID[=SIZE][@T]")]
    faults: Vec<String>,
    /// Excitation; staircase by default, dc-steps for a magnet motor; begins again at its end, and anew at each start
    #[arg(long, value_name = "NAME")]
    profile: Option<String>,
    /// Length of the profile
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Scatter of the motor's parameters: a unit of the production lot instead of the nominal motor (0.03: 3 %)
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    spread: f64,
    /// Seed of all randomness
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Cycles that an instruction takes
    #[arg(long, value_name = "CYCLES", default_value_t = 1.0)]
    pace: f64,
    /// At most so many times real time, 0.001 to 1
    #[arg(long, value_name = "FRACTION", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// File in which to publish the board's time; with the same --clock the time-outs of flash, record and monitor
    /// follow it
    #[arg(long, value_name = "FILE")]
    clock: Option<PathBuf>,
    /// File that keeps bank 2 of the flash, the parameters; without it they are gone at the end
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// Where to write the calibration of the rig's measuring chain, for `greyrig flash --calibration`
    #[arg(long, value_name = "FILE.toml")]
    calibration_out: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What is run at once, s of virtual time: ten samples.
const SLICE_S: f64 = 1e-3;
/// So many of these, and the clock is published again.
const SLICES_A_TIME: u32 = 5;
/// So far behind time, the host's time-outs begin to matter.
const BEHIND: Duration = Duration::from_millis(250);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// A sentence for the user, and the exit code.
type Failure = (String, u8);

/// Runs it.
pub fn main() -> ExitCode {
    let args = Args::parse();
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err((sentence, code)) => {
            eprintln!("greyrig board: {sentence}");
            ExitCode::from(code)
        }
    }
}

fn run(args: &Args) -> Result<(), Failure> {
    let image = image(args.image.as_deref())?;
    let rig = setup(args).and_then(Rig::new).map_err(|e| (e.to_string(), e.exit_code()))?;
    if let Some(path) = &args.calibration_out {
        std::fs::write(path, calibration(&rig.calibration())).map_err(|e| file(path, &e))?;
    }
    let contents = contents(args.flash.as_deref())?;
    let stopped = |e: greyrig_board::Fault| (e.to_string(), EXIT_HARDWARE);
    let mut board = Board::new(&image, contents, Box::new(rig), Pace::new(args.pace)).map_err(stopped)?;
    let mut terminal = Terminal::open().map_err(|e| (format!("no pseudo-terminal: {e}"), EXIT_HARDWARE))?;
    // A second handler could only be this one.
    let _ = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed));
    publish(args, &board)?;
    if args.json {
        let told = serde_json::json!({
            "schema": 1, "command": "board", "recordings": [], "port": terminal.name(), "clock": args.clock,
        });
        println!("{told}");
    } else {
        let clock = args.clock.as_ref().map_or_else(String::new, |file| format!(", its time in {}", file.display()));
        println!("a virtual NUCLEO-G474RE on {}{clock}, until Ctrl-C", terminal.name());
    }
    let outcome = serve(args, &mut board, &mut terminal);
    if let Some(path) = &args.clock {
        // A clock that is not there is told at once, one that stands still only later.
        let _ = std::fs::remove_file(path);
    }
    if let Some(path) = &args.flash {
        std::fs::write(path, &board.machine().flash.contents.bytes).map_err(|e| file(path, &e))?;
    }
    outcome
}

/// In real time or slower, as long as the machine is fast enough.
fn serve(args: &Args, board: &mut Board, terminal: &mut Terminal) -> Result<(), Failure> {
    let line = |e: std::io::Error| (format!("the pseudo-terminal has gone: {e}"), EXIT_HARDWARE);
    let (mut begin, mut begin_s) = (Instant::now(), board.seconds());
    let mut warned = false;
    let mut slices: u32 = 0;
    let (mut controller, mut shown) = (Controller::default(), Seen::Nothing);
    while !INTERRUPTED.load(Ordering::Relaxed) {
        let bytes = terminal.read().map_err(line)?;
        board.send(&bytes);
        board.run(SLICE_S).map_err(|e| (e.to_string(), EXIT_HARDWARE))?;
        let bytes = board.receive();
        terminal.write(&bytes).map_err(line)?;
        let seen = controller.look(board);
        if seen != shown {
            shown = seen;
            eprintln!("{}", words(seen));
        }
        slices = slices.wrapping_add(1);
        if slices.is_multiple_of(SLICES_A_TIME) {
            publish(args, board)?;
        }
        let due = begin + Duration::from_secs_f64((board.seconds() - begin_s) / args.speed);
        match due.checked_duration_since(Instant::now()) {
            Some(time) => std::thread::sleep(time),
            None if due.elapsed() > BEHIND => {
                let speed = (board.seconds() - begin_s) / begin.elapsed().as_secs_f64();
                if !warned {
                    let remedy = if args.clock.is_some() {
                        "give greyrig the same --clock if requests time out"
                    } else {
                        "close other programs or give --clock if requests time out"
                    };
                    eprintln!("greyrig board: runs at {speed:.2} times real time; {remedy}");
                    warned = true;
                }
                (begin, begin_s) = (Instant::now(), board.seconds());
            }
            None => {}
        }
    }
    Ok(())
}

/// Publishes the board's time, where it is wanted.
fn publish(args: &Args, board: &Board) -> Result<(), Failure> {
    let Some(path) = &args.clock else { return Ok(()) };
    clock::publish(path, Duration::from_secs_f64(board.seconds())).map_err(|e| file(path, &e))
}

/// A slower clock would be published too seldom.
fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().ok().filter(|speed| (0.001..=1.0).contains(speed));
    speed.ok_or_else(|| "give 0.001 to 1".to_owned())
}

/// What the pins say, in words.
const fn words(seen: Seen) -> &'static str {
    match seen {
        Seen::Nothing => "no verdict",
        Seen::Pass => "PB10 pulses: the motor passes",
        Seen::Alarm => "PB5 is high: the motor fails",
    }
}

fn setup(args: &Args) -> greyrig_host::error::Result<Setup> {
    let mut setup = Setup::new(args.kind).seed(args.seed);
    if args.spread > 0.0 {
        setup = setup.motor(Motor::sample_from_population(&Motor::nominal(args.kind), args.spread, args.seed));
    }
    if let Some(profile) = &args.profile {
        setup = setup.profile(profile)?;
    }
    setup.seconds = args.seconds;
    for effect in &args.effects {
        setup = setup.effect(effect)?;
    }
    for fault in &args.faults {
        setup = setup.fault(fault)?;
    }
    Ok(setup)
}

/// The image that is given, or the one beside this program in Cargo's folder.
fn image(given: Option<&Path>) -> Result<Image, Failure> {
    let built = std::env::current_exe()
        .ok()
        .and_then(|program| Some(program.parent()?.parent()?.join("thumbv7em-none-eabihf/firmware/nucleo-g474re")));
    let path = given.map(Path::to_owned).or(built).unwrap_or_default();
    let bytes = std::fs::read(&path).map_err(|e| {
        let sentence =
            format!("{}: {e}; build the firmware with `cargo fw`, or name an image with --image", path.display());
        (sentence, EXIT_BAD_INPUT)
    })?;
    Image::parse(&bytes).map_err(|e| (format!("{}: {e}", path.display()), EXIT_BAD_INPUT))
}

/// Bank 2, erased if there is no file yet.
fn contents(path: Option<&Path>) -> Result<Contents, Failure> {
    let Some(path) = path.filter(|path| path.exists()) else { return Ok(Contents::default()) };
    let bytes = std::fs::read(path).map_err(|e| file(path, &e))?;
    if bytes.len() != BANK_LENGTH {
        let sentence =
            format!("{} has {} bytes instead of {BANK_LENGTH}; give another file", path.display(), bytes.len());
        return Err((sentence, EXIT_BAD_INPUT));
    }
    Ok(Contents { bytes, ..Contents::default() })
}

fn file(path: &Path, error: &std::io::Error) -> Failure {
    (format!("{}: {error}; give another name", path.display()), EXIT_BAD_INPUT)
}

/// As `greyrig flash --calibration` reads it.
fn calibration(settings: &CalibrationSettings) -> String {
    [("voltage", settings.voltage), ("current", settings.current), ("speed", settings.speed)]
        .map(|(name, scale)| format!("[{name}]\nzero = {:?}\nper_count = {:?}\n", scale.zero, scale.per_count))
        .concat()
}
