//! Ten thousand samples a second, whatever else happens.

use greyrig::app::bench::Bench;
use greyrig::faults::Fault;
use greyrig::link::message::Request;
use greyrig_board::Board;
use greyrig_board::board::CLOCK_HZ;
use greyrig_board::host::Host;
use greyrig_board::machine::Pace;
use greyrig_board::peripherals::flash::Contents;

use crate::station::{rig, station};
use crate::{board, count, image, payload};

/// The processor's cycles between two samples.
const PERIOD: u64 = CLOCK_HZ / 10_000;

/// How long to look, s: 10, or a minute with GREYRIG_LONG set, as `cargo xtask test --long` does.
fn seconds() -> f64 {
    if std::env::var_os("GREYRIG_LONG").is_some() { 60.0 } else { 10.0 }
}

/// Time that this thread has had on a processor, s: other work on the machine does not count.
fn processor_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Telemetry runs, and parameters are written four times a second; each time two pages are erased at most. Cycles per
/// instruction as given; 1.5 is a pessimistic figure for code without wait states, of which many instructions take one
/// cycle, loads and taken branches two or three.
fn samples_go_on(cycles_per_instruction: f64) {
    let mut host = Host::default();
    let mut board =
        Board::new(image(), Contents::default(), rig("steady", 7.0, 1, None), Pace::new(cycles_per_instruction))
            .unwrap();
    let full = &station().payload;
    host.flash(&mut board, full).unwrap();
    host.tell(&mut board, Request::ClearFaults).unwrap();
    host.tell(&mut board, Request::StartTelemetry { every: 100 }).unwrap();
    let (started, begin, mut n) = (processor_seconds(), board.seconds(), 0_u32);
    while board.seconds() < begin + seconds() {
        let payload = if n % 2 == 0 { payload("one") } else { full.clone() };
        host.bring(&mut board, &payload).unwrap();
        let block = host.commit(&mut board, &payload).unwrap();
        assert_eq!(block.sequence, n + 2);
        n += 1;
        board.run(0.25).unwrap();
        host.look(&mut board, |_| ());
    }
    let status = host.status(&mut board).unwrap();
    let machine = board.machine();
    // A sample may be converted while the answer is on its way: 20 ms at most.
    let missing = machine.adc.sequences() - u64::from(status.samples);
    assert!(missing < 200, "{missing} samples were not taken");
    for fault in [Fault::TickOverrun, Fault::TelemetryLost, Fault::FlashWrite, Fault::FlashUnreadable, Fault::BadFrame]
    {
        assert_eq!(count(&status, fault), 0, "{fault:?}");
    }
    assert_eq!(machine.adc.ignored(), 0);
    // What the thread keeps interrupts off for, and the longest tick after that: before the next sample.
    let worst = machine.latest + u64::from(status.cycles[1]);
    assert!(worst < PERIOD, "an interrupt came {} cycles late, a tick took {}", machine.latest, status.cycles[1]);
    // Every hundredth sample ends a report; those of the first and the last are under way.
    let expected = (seconds() * 100.0) as usize;
    assert!(host.reports.len() >= expected, "{} reports", host.reports.len());
    assert!(host.reports.windows(2).all(|pair| pair[1].sample == pair[0].sample + 100));
    let (simulated, taken) = (board.seconds() - begin, processor_seconds() - started);
    println!(
        "{cycles_per_instruction} cycles per instruction: {simulated:.2} s in {taken:.2} s of a core, {n} blocks written, {} samples, none \
         lost or late, longest tick {} cycles of {PERIOD}, latest interrupt {} cycles",
        status.samples, status.cycles[1], machine.latest
    );
    // A fifth of real time, so that the host's time-outs, ten times what an answer takes, still hold.
    assert!(simulated > 0.2 * taken, "{simulated} s took {taken} s");
}

#[test]
fn no_sample_is_lost_or_late_at_a_cycle_per_instruction() {
    samples_go_on(1.0);
}

#[test]
fn no_sample_is_lost_or_late_at_one_and_a_half() {
    samples_go_on(1.5);
}

#[test]
fn a_recording_has_every_sample_in_its_place() {
    let (mut board, mut host) = (board(), Host::default());
    host.tell(&mut board, Request::StartCapture).unwrap();
    board.run(2.0).unwrap();
    host.tell(&mut board, Request::Stop).unwrap();
    // 32 samples make a frame (src/link/packing.rs); at the end one is not full.
    assert!(host.samples.len() > 20_000 - 64, "{} samples", host.samples.len());
    assert_eq!(host.garbled, 0);
    let mut motor = Bench::new().unwrap();
    let truth: Vec<_> = std::iter::repeat_with(|| motor.counts()).take(30_000).collect();
    let first = host.samples[0].0;
    for (n, (number, counts)) in host.samples.iter().enumerate() {
        assert_eq!(*number as usize, first as usize + n);
        assert_eq!(*counts, truth[*number as usize], "sample {number}");
    }
}

/// A debugger goes and leaves DBG_SLEEP as it was before it came: the processor's cycle counter stands in sleep from then
/// on, and the samples are numbered all the same.
#[test]
fn time_goes_on_when_the_debugger_leaves() {
    let (mut board, mut host) = (board(), Host::default());
    host.flash(&mut board, &payload("probed")).unwrap();
    assert!(board.machine().dbgmcu.keeps_clocks_in_sleep(), "the firmware's driver sets it");
    board.run(0.2).unwrap();
    board.machine_mut().dbgmcu.detach();
    let sequences = board.machine().adc.sequences();
    let before = host.status(&mut board).unwrap().samples;
    host.tell(&mut board, Request::StartCapture).unwrap();
    board.run(1.0).unwrap();
    host.tell(&mut board, Request::Stop).unwrap();
    let status = host.status(&mut board).unwrap();
    let converted = board.machine().adc.sequences() - sequences;
    // Two conversations, of 20 ms at most each.
    assert!(
        converted > 10_000 && converted.abs_diff(u64::from(status.samples - before)) < 200,
        "{converted} {status:?}"
    );
    assert!(host.samples.len() > 10_000 - 64, "{} samples", host.samples.len());
    assert!(host.samples.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1));
    assert_eq!([Fault::TimeBase, Fault::TickOverrun].map(|fault| count(&status, fault)), [0, 0]);
    // What the tick takes is counted while the processor is awake.
    assert!((500..17_000).contains(&status.cycles[0]), "{status:?}");
    // A reset by the program leaves what the debugger has left until the driver asks anew.
    board.press_reset();
    board.run(0.1).unwrap();
    assert!(board.machine().dbgmcu.keeps_clocks_in_sleep());
}

/// The trigger stays away for a fifth of a second, too short for the watchdog: it is told, once.
#[test]
fn samples_that_never_came_are_told() {
    let (mut board, mut host) = (board(), Host::default());
    host.flash(&mut board, &payload("stopped")).unwrap();
    board.run(2.0).unwrap();
    assert_eq!(count(&host.status(&mut board).unwrap(), Fault::TimeBase), 0);
    board.machine_mut().trigger_cut = true;
    board.run(0.2).unwrap();
    board.machine_mut().trigger_cut = false;
    board.run(3.0).unwrap();
    let status = host.status(&mut board).unwrap();
    assert_eq!([Fault::TimeBase, Fault::WatchdogReset].map(|fault| count(&status, fault)), [1, 0]);
}

/// Whoever asks for more than the line carries is refused, and the host is heard; what is granted is carried whole.
#[test]
fn the_line_is_never_asked_for_more_than_it_carries() {
    let (mut board, mut host) = (board(), Host::default());
    host.flash(&mut board, &payload("talkative")).unwrap();
    host.tell(&mut board, Request::ClearFaults).unwrap();
    for every in [1, 3, 4] {
        let answer =
            host.ask(&mut board, Request::StartTelemetry { every }, |reply| Some(format!("{reply:?}"))).unwrap();
        assert_eq!(answer, "Refused(Line)", "{every}");
    }
    for (every, capture) in [(5, false), (10, true)] {
        host.tell(&mut board, Request::StartTelemetry { every }).unwrap();
        if capture {
            host.tell(&mut board, Request::StartCapture).unwrap();
        }
        let begin = host.reports.len();
        board.run(1.0).unwrap();
        let status = host.status(&mut board).unwrap();
        host.tell(&mut board, Request::Stop).unwrap();
        let lost = [Fault::TelemetryLost, Fault::CaptureLost, Fault::TickOverrun].map(|fault| count(&status, fault));
        assert_eq!(lost, [0; 3], "every {every}");
        assert!(host.reports.len() - begin >= 10_000 / usize::from(every), "every {every}");
        assert_eq!(host.garbled, 0);
    }
}
