//! Fuzzes one target: `cargo xtask fuzz` runs this for each.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::Parser;
use greyrig_fuzz::mutate::Mutator;
use greyrig_fuzz::{Seen, Target, inputs, target};

/// An input that takes longer hangs. The machine may be busy.
const HANG: Duration = Duration::from_secs(20);
/// Most memory that the process may have had, MB. Inputs have a few kilobytes.
const MOST_MB: u64 = 1024;
/// Failures after which it ends, most of them of the same place.
const ENOUGH: usize = 1000;

/// Fuzzes one target.
#[derive(Debug, Parser)]
struct Args {
    /// The target
    target: String,
    /// How long, s
    #[arg(long, default_value_t = 60)]
    seconds: u64,
    /// Begin of the sequence of inputs
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for inputs that fail
    #[arg(long, value_name = "FOLDER")]
    save: PathBuf,
    /// File that each input is written to before it is run: after an abort it holds the input
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Run this file instead
    #[arg(long, value_name = "FILE")]
    replay: Option<PathBuf>,
}

/// The input under way, and since when.
type Current = Arc<Mutex<Option<(Instant, Vec<u8>)>>>;

fn main() -> ExitCode {
    let args = Args::parse();
    let Some(target) = target(&args.target) else {
        eprintln!("there is no target {}", args.target);
        return ExitCode::from(2);
    };
    match run(&args, target) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("greyrig-fuzz: {error}");
            ExitCode::from(2)
        }
    }
}

/// Whether nothing failed.
fn run(args: &Args, target: &Target) -> std::io::Result<bool> {
    if let Some(path) = &args.replay {
        let result = target.run(&std::fs::read(path)?);
        println!("{result:?}");
        return Ok(result.is_ok());
    }
    let current = Current::default();
    watch(&current, &args.save);
    let mut places = BTreeSet::new();
    let mut one = |input: &[u8]| -> std::io::Result<Option<Seen>> {
        if let Some(path) = &args.trace {
            std::fs::write(path, input)?;
        }
        *current.lock().unwrap_or_else(PoisonError::into_inner) = Some((Instant::now(), input.to_vec()));
        let result = target.run(input);
        *current.lock().unwrap_or_else(PoisonError::into_inner) = None;
        match result {
            Ok(seen) => Ok(Some(seen)),
            Err(panic) => {
                // One of each place is enough.
                let place = panic.split(": ").next().unwrap_or_default().to_owned();
                if places.insert(place) {
                    let path = save(&args.save, input)?;
                    eprintln!("{}: {panic}; the input is {}", target.name, path.display());
                }
                Ok(None)
            }
        }
    };

    let seeds = inputs(target)?.iter().map(std::fs::read).collect::<std::io::Result<Vec<_>>>()?;
    let mut mutator = Mutator::new(args.seed, seeds.clone());
    let begin = Instant::now();
    let mut count = 0_u64;
    for seed in seeds {
        if let Some(seen) = one(&seed)? {
            mutator.tell(&seed, seen);
        }
        count += 1;
    }
    let mut failed = 0;
    // The clock is looked at now and then, since some targets take a microsecond.
    while !(count.is_multiple_of(16) && begin.elapsed().as_secs() >= args.seconds) && failed < ENOUGH {
        let input = mutator.next();
        match one(&input)? {
            Some(seen) => mutator.tell(&input, seen),
            None => failed += 1,
        }
        count += 1;
    }
    let memory = most_memory_mb();
    let failed = places.len();
    println!("inputs {count} kept {} memory {memory} MB failures {failed}", mutator.kept());
    if memory > MOST_MB {
        eprintln!("{}: {memory} MB of memory were taken; --trace and a smaller --seconds find the input", target.name);
    }
    Ok(failed == 0 && memory <= MOST_MB)
}

/// Ends the program when an input hangs.
fn watch(current: &Current, folder: &Path) {
    let (current, folder) = (Arc::clone(current), folder.to_owned());
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(HANG / 10);
            let hangs = current.lock().unwrap_or_else(PoisonError::into_inner).clone();
            if let Some((begin, input)) = hangs
                && begin.elapsed() > HANG
            {
                match save(&folder, &input) {
                    Ok(path) => eprintln!("more than {} s: the input is {}", HANG.as_secs(), path.display()),
                    Err(error) => eprintln!("more than {} s, and the input cannot be written: {error}", HANG.as_secs()),
                }
                std::process::exit(1);
            }
        }
    });
}

fn save(folder: &Path, input: &[u8]) -> std::io::Result<PathBuf> {
    std::fs::create_dir_all(folder)?;
    // FNV-1a, for a name that is the same on every machine.
    let hash = input
        .iter()
        .fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3));
    let path = folder.join(format!("{hash:016x}"));
    std::fs::write(&path, input)?;
    Ok(path)
}

/// The most that the process has had; 0 where the system does not say.
fn most_memory_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|rest| rest.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) / 1024
}
