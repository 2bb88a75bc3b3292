//! The host and the emulated microcontroller compute the same bits, and the instruction counts are exact.

#[path = "../../image.rs"]
mod image;

use std::collections::BTreeSet;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use greyrig::detector::STEPS;
use greyrig_target_tests::counted::{self, Counter, REVERSAL, REVERSALS, Reversals};
use greyrig_target_tests::scenarios;

/// The most instructions that may be spent on a sample, so that nobody makes the filter slower unawares: a tenth above
/// what was measured with rustc 1.95.
const LIMITS: [(&str, u32); 22] = [
    // The budget of a sample, whatever was measured.
    ("interrupt_full_bell_free", 2000),
    ("interrupt_full_bell_2", 2000),
    ("interrupt_full_periods_bell_free", 2000),
    ("interrupt_full_periods_bell_2", 2000),
    ("interrupt_full_reversing_bell_free", 2000),
    ("interrupt_full_reversing_bell_2", 2000),
    ("interrupt_full_reversing_judged_bell_free", 2000),
    ("interrupt_full_reversing_judged_bell_2", 2000),
    // The sequence, which runs after the tick: of 4,000 for the whole interrupt.
    ("station", 410),
    ("interrupt", 854),
    ("tick", 677),
    ("motor_step", 321),
    ("motor_step_effects", 1766),
    ("butterworth_f32_order_2", 44),
    ("butterworth_f32_order_4", 63),
    ("butterworth_f32_order_8", 101),
    ("butterworth_fixed_order_4", 83),
    ("anfis_bell_free", 746),
    ("anfis_bell_1", 400),
    ("anfis_bell_2", 400),
    ("anfis_gaussian", 589),
    ("anfis_minimum", 1302),
];

/// Builds the program for the emulated board.
fn build() -> PathBuf {
    let target = ["build", "--profile", "firmware", "--target", "thumbv7em-none-eabihf"];
    image::build(&[&target[..], &["--package", "greyrig-target-tests", "--bin", "on-target"]].concat())
}

/// Runs the program and gives what it printed. An endless loop, such as that after a hard fault, is ended.
fn run(program: &Path) -> String {
    let mut emulator = Command::new("qemu-system-arm")
        .args(["-M", "mps2-an386", "-nographic", "-monitor", "none"])
        .args(["-semihosting-config", "enable=on,target=native"])
        // An instruction takes 2^10 ns of the board's time, whatever the host's load.
        .args(["-icount", "shift=10,sleep=off"])
        .arg("-kernel")
        .arg(program)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .expect("needs qemu-system-arm (on Debian: apt-get install qemu-system-arm)");
    let mut stdout = emulator.stdout.take().expect("stdout is a pipe");
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        stdout.read_to_string(&mut text).map(|_| text)
    });
    let deadline = Instant::now() + Duration::from_secs(120);
    let status = loop {
        match emulator.try_wait().expect("the emulator can be waited for") {
            Some(status) => break Some(status),
            None if Instant::now() > deadline => {
                emulator.kill().expect("the emulator can be ended");
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    let text = reader.join().expect("the reader ends").expect("the program prints UTF-8");
    assert!(status.is_some_and(|status| status.success()), "{status:?} after:\n{text}");
    text
}

struct Names(Vec<String>);

impl Counter for Names {
    fn count_runs<S>(
        &mut self,
        name: &str,
        _: usize,
        mut state: S,
        mut ready: impl FnMut(&mut S),
        mut run: impl FnMut(&mut S),
    ) {
        ready(&mut state);
        run(&mut state);
        self.0.push(name.to_owned());
    }
}

#[test]
fn host_equals_target() {
    let printed = run(&build());
    assert_eq!(printed.lines().last(), Some("done"));

    let mut host = String::new();
    greyrig_target_tests::write_bits(&mut host).expect("a string takes everything");
    let target: Vec<_> = printed.lines().filter(|line| line.starts_with("bits") || line.starts_with("first")).collect();
    for (host, target) in host.lines().zip(&target) {
        assert_eq!(host, *target, "host (left) and target differ, at the latest at the output counted here");
    }
    assert_eq!(host.lines().count(), target.len());

    let counts: Vec<(&str, u32)> = printed
        .lines()
        .filter_map(|line| line.strip_prefix("count "))
        .map(|line| {
            let mut words = line.split(' ');
            let name = words.next().expect("a name");
            (name, words.next().and_then(|count| count.parse().ok()).expect("a count"))
        })
        .collect();
    println!("| instructions (QEMU, Cortex-M4F) | most |\n| --- | --- |");
    for (name, count) in &counts {
        println!("| {name} | {count} |");
    }
    let count = |name| counts.iter().find(|(n, _)| *n == name).map(|(_, count)| *count);
    assert_eq!(count("self_test_100_nops"), Some(100));
    assert_eq!(count("self_test_3_nops"), Some(3));
    for (name, limit) in LIMITS {
        let count = count(name).unwrap_or_else(|| panic!("{name} was not counted"));
        assert!(count <= limit, "{name} takes {count} instructions, more than {limit}");
    }
    // The network takes the same time wherever it is asked.
    for name in ["anfis_in_the_margin", "anfis_far_outside", "anfis_nan"] {
        assert_eq!(count(name), count("anfis_inside"), "{name}");
    }
    let mut names = Names(Vec::new());
    counted::all(&mut names);
    assert_eq!(counts.len(), names.0.len() + 2, "{names}", names = names.0.join(" "));
}

/// What is counted of reversals during a judgement meets every step of it.
#[test]
fn the_rotor_is_turned_round_at_every_step_of_a_judgement() {
    /// Samples of the first period.
    const PERIOD: u16 = 200;
    let shared = scenarios::busy_shared();
    let turned: BTreeSet<u16> = (0..REVERSALS)
        .filter_map(|n| {
            let mut sampler = Reversals::JUDGED.sampler(&shared, None, n)?;
            let mut crosses = |n| sampler.sample((Reversals::JUDGED.counts)(n), 0).is_some_and(|o| o.crossed_zero);
            (1..=REVERSAL).find(|&n| crosses(n))
        })
        .collect();
    for step in 1..=STEPS as u16 {
        assert!(turned.contains(&(PERIOD + 1 + step)), "step {step} of {turned:?}");
    }
}
