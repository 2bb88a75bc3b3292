//! The station's sequence on the firmware as it is flashed: the motor runs on what the board's own pins command.

use greyrig::link::message::{Mode, Refusal, Reply, Request, Run};
use greyrig::parameters::block::MAX_PAYLOAD;
use greyrig::parameters::rig::MAX_RIG;
use greyrig::parameters::{FINGERPRINT, Rig, Settings, section};
use greyrig::sequence::{self, Segment, State, Stop, Stuck, Supplied, Supply, Wave};
use greyrig_board::Board;
use greyrig_board::analog::Counts;
use greyrig_board::board::CLOCK_HZ;
use greyrig_board::host::{Host, commit};
use greyrig_board::machine::Pace;
use greyrig_board::peripherals::NEVER;
use greyrig_board::peripherals::flash::Contents;

use crate::image;
use crate::station::{commanded, station};

/// Peak of 230 V, which the supply gives at full command.
const FULL_V: f64 = 230.0 * std::f64::consts::SQRT_2;
/// Length of the profile, s.
const TEST_S: f32 = 6.5;
/// The current that trips, A: a soft start draws 20 A.
const TRIP_A: f32 = 34.0;
/// A sample, s.
const SAMPLE_S: f64 = 1e-4;

fn wave() -> Wave {
    Wave::Alternating { frequency_hz: 50.0 }
}

/// The profile `steady`: from a tenth up to nominal voltage within 15 % of the time, then that.
fn sequence() -> sequence::Settings {
    let full = FULL_V as f32;
    let segment = |seconds, from_v| Segment { seconds, from_v, to_v: full, supplied: Supplied::On };
    sequence::Settings {
        wave: wave(),
        segments: [segment(0.15 * TEST_S, 0.1 * full), segment(0.85 * TEST_S, full)].into_iter().collect(),
        trip_a: TRIP_A,
        overspeed_rad_s: 4300.0,
        stuck: Stuck { from_v: 200.0, below_rad_s: 50.0, within_s: 0.2 },
        // It runs down for half a minute; the tests wait for the begin of that.
        rest_rad_s: 3000.0,
        time_out_s: 12.0,
    }
}

/// A station with a motor, flashed.
struct Line {
    board: Board,
    host: Host,
}

impl Line {
    fn new(seed: u64, fault: Option<&str>) -> Self {
        let (motor, calibration) = commanded(seed, fault, FULL_V);
        let board = Board::new(image(), Contents::default(), motor, Pace::ONE).unwrap();
        let mut line = Self { board, host: Host::default() };
        let supply = Some(Supply { wave: wave(), full_scale_v: FULL_V as f32 });
        let rig = Rig { name: "virtual".try_into().unwrap(), calibration, supply };
        let rig = rig.encode(&mut [0; MAX_RIG]).unwrap().to_vec();
        line.host.bring(&mut line.board, &rig).unwrap();
        let Request::CommitParameters { length, crc, .. } = commit(&rig) else { unreachable!("a commitment") };
        let request = Request::CommitRig { fingerprint: FINGERPRINT, length, crc };
        line.host.ask(&mut line.board, request, |reply| matches!(reply, Reply::Committed(_)).then_some(())).unwrap();
        let type_ = section::decode(&station().payload).unwrap();
        let settings = Settings { rig: None, sequence: Some(sequence()), ..type_ };
        let payload = section::encode(&settings, &mut [0; MAX_PAYLOAD]).unwrap().to_vec();
        assert_eq!(line.host.flash(&mut line.board, &payload).unwrap().mode, Mode::Running);
        line
    }

    /// Another motor is put in.
    fn exchange(&mut self, seed: u64, fault: Option<&str>) {
        self.board.connect(commanded(seed, fault, FULL_V).0);
    }

    fn run(&mut self) -> Run {
        self.host
            .ask(
                &mut self.board,
                Request::RunState,
                |reply| if let Reply::Run(run) = reply { Some(*run) } else { None },
            )
            .unwrap()
    }

    /// START is pressed and let go.
    fn press_start(&mut self) {
        for pressed in [true, false] {
            self.board.turn(|wires| wires.start = pressed);
            self.board.run(0.03).unwrap();
        }
    }

    /// Ready to run.
    fn acknowledged(mut self) -> Self {
        assert_eq!(self.run().state, State::Stopped(Stop::Power));
        self.host.tell(&mut self.board, Request::Acknowledge).unwrap();
        assert_eq!(self.run().state, State::Idle);
        self
    }

    fn started(&mut self) {
        let run = self.run().runs + 1;
        self.host.tell(&mut self.board, Request::StartRun { run }).unwrap();
        let now = self.run();
        assert_eq!((now.state, now.runs), (State::Running, run));
    }

    /// Runs until the supply is off, in steps of 1 µs; the time that it took, s.
    fn until_off(&mut self, most_s: f64) -> f64 {
        let begin = self.board.machine().now;
        let since = |board: &Board| (board.machine().now - begin) as f64 / CLOCK_HZ as f64;
        while self.board.supply() != (false, 0.0) {
            assert!(since(&self.board) < most_s, "the supply is on after {} s", since(&self.board));
            self.board.run(1e-6).unwrap();
        }
        since(&self.board)
    }
}

/// Motors of a lot one after another, by the button, some of them with faults: no host is asked but for what is
/// checked.
#[test]
fn a_line_of_motors() {
    let mut line = Line::new(101, None);
    line.press_start();
    assert_eq!(line.run().state, State::Idle, "the first press acknowledges");
    let motors: [(u64, Option<&str>, State); 6] = [
        (101, None, State::Passed),
        (102, Some("sparking=0.3@5"), State::Failed),
        (103, None, State::Passed),
        (104, Some("sparking=0.3@5"), State::Failed),
        (105, None, State::Passed),
        (106, None, State::Passed),
    ];
    for (n, (seed, fault, expected)) in (1..).zip(motors) {
        line.exchange(seed, fault);
        line.board.run(0.1).unwrap();
        line.press_start();
        assert_eq!((line.run().state, line.run().runs), (State::Running, n));
        assert!(line.board.supply().0);
        line.board.run(f64::from(TEST_S) - 0.5).unwrap();
        let (closed, fraction) = line.board.supply();
        // A step of the PWM is 1/8500.
        assert!(closed && (fraction - 1.0).abs() < 2.0 / 8500.0, "{fraction}");
        assert_eq!(line.run().state, State::Running);
        line.board.run(2.0).unwrap();
        let run = line.run();
        assert_eq!((run.state, line.board.supply()), (expected, (false, 0.0)), "motor {seed} with {fault:?}");
        // The pins say so, without a host.
        let shown: Vec<[bool; 3]> = (0..200)
            .map(|_| {
                line.board.run(1e-3).unwrap();
                ["PB10", "PB5", "PB6"].map(|pin| line.board.is_high(pin))
            })
            .collect();
        let edges = shown.windows(2).filter(|pair| pair[0][0] != pair[1][0]).count();
        assert_eq!(edges >= 3, expected == State::Passed, "{edges} edges of the pass");
        assert!(shown.iter().all(|[_, alarm, busy]| *alarm == (expected == State::Failed) && !busy));
    }
}

/// Whoever aborts, and whenever: the supply is off within a sample after the debounce of 2 ms.
#[test]
fn every_abort_ends_in_the_safe_state() {
    let mut line = Line::new(101, None).acknowledged();
    line.started();
    line.board.run(0.2).unwrap();
    let mut longest: f64 = 0.0;
    // Instants that fall everywhere within a sample and a period of the mains.
    for n in 0..40 {
        line.board.run(0.013 + 3.7e-6 * f64::from(n)).unwrap();
        assert!(line.board.supply().0);
        let stop = match n % 4 {
            0 => {
                line.board.turn(|wires| wires.abort = true);
                Stop::Abort
            }
            // Its feedback alone: the contactor's coil is not asked.
            1 | 2 => {
                line.board.turn(|wires| wires.feedback_broken = true);
                Stop::EmergencyStop
            }
            _ => {
                line.board.turn(|wires| wires.emergency = true);
                assert!(!line.board.supply().0, "it opens the supply by itself");
                Stop::EmergencyStop
            }
        };
        let took = line.until_off(5e-3);
        // From the first of twenty samples to the last, up to one before in which it was just not seen, and the
        // interrupt.
        assert!((19.0 * SAMPLE_S..20.0 * SAMPLE_S + 20e-6).contains(&took), "{n}: {took} s");
        longest = longest.max(took);
        line.board.run(0.01).unwrap();
        assert_eq!((line.run().state, line.board.supply()), (State::Stopped(stop), (false, 0.0)), "{n}");
        // While it is open nothing starts and nothing is acknowledged.
        line.host.tell(&mut line.board, Request::Acknowledge).unwrap();
        assert_eq!(line.run().state, State::Stopped(stop));
        line.board.turn(|wires| (wires.abort, wires.emergency, wires.feedback_broken) = (false, false, false));
        line.board.run(0.01).unwrap();
        line.host.tell(&mut line.board, Request::Acknowledge).unwrap();
        line.started();
    }
    println!("the longest of 40 stops took {:.2} ms", 1e3 * longest);
    // Over the link.
    line.host.tell(&mut line.board, Request::AbortRun).unwrap();
    assert_eq!((line.run().state, line.board.supply()), (State::Stopped(Stop::Abort), (false, 0.0)));
}

/// The comparators cut the supply before the program knows of it, and it stays cut.
#[test]
fn over_current_is_cut_by_the_hardware() {
    let mut line = Line::new(101, None).acknowledged();
    for counts in [4095, 0] {
        line.started();
        line.board.run(0.3).unwrap();
        line.board.connect(Box::new(Counts::new(std::iter::repeat([2048, counts, 1000]))));
        // With the very sample: no interrupt has come in between.
        let took = line.until_off(2.0 * SAMPLE_S);
        assert!(took <= SAMPLE_S + 2e-6, "{took} s");
        assert_ne!(line.board.machine().adc.next(), NEVER, "the conversion has not ended");
        line.board.run(0.01).unwrap();
        let run = line.run();
        assert_eq!((run.state, run.tripped), (State::Stopped(Stop::OverCurrent), true), "{counts}");
        // Acknowledged while the current is still there: it trips anew.
        line.host.tell(&mut line.board, Request::Acknowledge).unwrap();
        assert_eq!(line.run().state, State::Stopped(Stop::OverCurrent));
        assert_eq!(line.board.supply(), (false, 0.0));
        line.exchange(101, None);
        line.board.run(0.01).unwrap();
        line.host.tell(&mut line.board, Request::Acknowledge).unwrap();
        assert_eq!(line.run().state, State::Idle);
    }
}

/// A rotor that is held, and a sampling that stands still.
#[test]
fn what_the_program_watches() {
    let mut line = Line::new(101, None).acknowledged();
    line.started();
    line.board.run(0.2).unwrap();
    // The wire of the speed comes off: a voltage, and no speed.
    let still = commanded(101, None, FULL_V).1.speed.zero.round() as u16;
    line.board.connect(Box::new(Counts::new((0..).map(move |n| [2048, 2048 + n % 3, still]))));
    line.board.run(1.0).unwrap();
    assert_eq!((line.run().state, line.board.supply()), (State::Stopped(Stop::StuckRotor), (false, 0.0)));
    line.exchange(101, None);
    line.board.run(0.01).unwrap();
    line.host.tell(&mut line.board, Request::Acknowledge).unwrap();
    line.started();
    line.board.run(0.2).unwrap();
    line.board.machine_mut().trigger_cut = true;
    let took = line.until_off(30e-3);
    println!("with its trigger off the supply was cut after {:.1} ms", 1e3 * took);
    line.board.machine_mut().trigger_cut = false;
    line.board.run(0.01).unwrap();
    assert_eq!(line.run().state, State::Stopped(Stop::Sampling));
    // A reset within a run: nothing is driven, and nothing moves until somebody has acknowledged it.
    line.host.tell(&mut line.board, Request::Acknowledge).unwrap();
    line.started();
    line.board.run(0.2).unwrap();
    assert!(line.board.supply().0);
    line.board.press_reset();
    line.board.run(1e-5).unwrap();
    assert_eq!(line.board.supply(), (false, 0.0));
    line.board.run(0.1).unwrap();
    assert_eq!((line.run().state, line.board.supply()), (State::Stopped(Stop::Power), (false, 0.0)));
    let run = line.run().runs + 1;
    let refused = line.host.ask(&mut line.board, Request::StartRun { run }, |reply| {
        matches!(reply, Reply::Refused(Refusal::Stopped)).then_some(())
    });
    refused.unwrap();
}
