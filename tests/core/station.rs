//! The sequence in the application: a motor whose supply is commanded, contacts, the link, lamps.

use greyrig::app::bench::{Bench, PEAK, Trouble};
use greyrig::app::chain::FAULTS;
use greyrig::app::lamps::{Lamps, PULSES_HZ};
use greyrig::app::{Station, Switchgear};
use greyrig::detector::Verdict;
use greyrig::faults::Fault;
use greyrig::hardware::NUCLEO_G474RE;
use greyrig::link::message::{Refusal, Request, Run};
use greyrig::parameters::rig::MAX_RIG;
use greyrig::parameters::{Rig as OfRig, Settings};
use greyrig::sequence::{self, Contacts, Segment, State, Stop, Stuck, Supplied, Supply, Wave};

use crate::app::{Heard, Rig, board_with, run, station};
use crate::nor::Nor;

const WAVE: Wave = Wave::Alternating { frequency_hz: 50.0 };

/// Half a second up, two and a half at full voltage.
fn with_sequence() -> Settings {
    let segment = |seconds, from_v| Segment { seconds, from_v, to_v: PEAK, supplied: Supplied::On };
    let sequence = sequence::Settings {
        wave: WAVE,
        segments: [segment(0.5, 0.0), segment(2.5, PEAK)].into_iter().collect(),
        trip_a: 30.0,
        overspeed_rad_s: 4500.0,
        stuck: Stuck { from_v: 200.0, below_rad_s: 20.0, within_s: 0.5 },
        // The bench runs down slowly; what is tested here does not wait for it.
        rest_rad_s: 2900.0,
        time_out_s: 5.0,
    };
    Settings { sequence: Some(sequence), ..station() }
}

/// Samples of the profile.
const PROFILE: u32 = 30_000;

/// What the station switches, as a struct.
struct Gear {
    contacts: Contacts,
    tripped: bool,
    closed: bool,
    fraction: f32,
    arms: u32,
    trip: Option<[u16; 2]>,
}

impl Gear {
    fn new() -> Self {
        let contacts = Contacts { start: false, abort_closed: true, emergency_closed: true };
        Self { contacts, tripped: false, closed: true, fraction: 1.0, arms: 0, trip: None }
    }
}

impl Switchgear for Gear {
    fn contacts(&mut self) -> Contacts {
        self.contacts
    }
    fn has_tripped(&mut self) -> bool {
        self.tripped
    }
    fn arm(&mut self) {
        self.arms += 1;
        self.tripped = false;
    }
    fn trip_outside(&mut self, counts: [u16; 2]) {
        self.trip = Some(counts);
    }
    fn supply(&mut self, closed: bool, fraction: f32) {
        (self.closed, self.fraction) = (closed, fraction);
    }
}

/// A station with a motor.
struct Line<'r, 'a> {
    rig: &'r mut Rig<'a>,
    station: Station<'a, Gear>,
    bench: Bench,
}

impl Line<'_, '_> {
    fn gear(&mut self) -> &mut Gear {
        self.station.switchgear()
    }

    fn samples(&mut self, count: u32) {
        for _ in 0..count {
            let Gear { closed, fraction, .. } = *self.station.switchgear();
            let counts = self.bench.counts_at(if closed { PEAK * fraction } else { 0.0 });
            let output = self.rig.sampler.sample(counts, 0);
            self.station.sample(&output, 0);
            self.rig.unasked();
        }
    }

    fn state(&mut self) -> Run {
        let Heard::Run(run) = self.rig.ask(Request::RunState) else { panic!("a station has a state") };
        assert_eq!(self.rig.server.state(), Some(run.state));
        run
    }

    /// Presses START and lets go of it.
    fn press_start(&mut self) {
        for start in [true, false] {
            self.gear().contacts.start = start;
            self.samples(250);
        }
    }

    /// Until the run has ended, 6 s at most.
    fn until_ended(&mut self) -> State {
        for _ in 0..600 {
            self.samples(100);
            if !self.state().state.is_busy() {
                break;
            }
        }
        self.state().state
    }
}

/// A station under power whose contacts are closed.
fn line(settings: &Settings, supply: Option<Supply>, work: impl FnOnce(&mut Line)) {
    let rig = OfRig { supply, ..OfRig::default() };
    let rig = rig.encode(&mut [0; MAX_RIG]).expect("it fits").to_vec();
    let (flash, ()) = run(board_with(settings), |board| drop(board.commit_rig(&rig)));
    run(flash, |board| {
        let sequence = board.server.take_sequence();
        let station = Station::new(sequence, Gear::new(), board.shared);
        let mut line = Line { rig: board, station, bench: Bench::new().expect("a motor") };
        line.samples(300);
        work(&mut line);
    });
}

const SUPPLY: Option<Supply> = Some(Supply { wave: WAVE, full_scale_v: PEAK });

/// The same, and ready to run.
fn ready(work: impl FnOnce(&mut Line)) {
    line(&with_sequence(), SUPPLY, |line| {
        assert_eq!(line.rig.ask(Request::Acknowledge), Heard::Done);
        line.samples(1);
        assert_eq!(line.state().state, State::Idle);
        work(line);
    });
}

#[test]
fn a_motor_is_tested_without_a_host() {
    line(&with_sequence(), SUPPLY, |line| {
        assert_eq!(line.state().state, State::Stopped(Stop::Power));
        assert_eq!((line.gear().closed, line.gear().fraction, line.gear().arms), (false, 0.0, 0));
        // 30 A of 80 A/4095 a count around 2047.5: 511.9 to 3583.1.
        assert_eq!(line.gear().trip, Some([512, 3583]));
        line.press_start();
        assert_eq!((line.state().state, line.gear().arms), (State::Idle, 1));
        assert_eq!(line.state().runs, 0);
        for (run, trouble, state) in [
            (1, Trouble::None, State::Passed),
            (2, Trouble::Resistance, State::Failed),
            (3, Trouble::None, State::Passed),
        ] {
            line.bench = Bench::new().unwrap();
            line.press_start();
            let status = line.state();
            assert_eq!((status.state, status.runs, status.length), (State::Running, run, PROFILE));
            assert_eq!(status.test, run, "the run's own test");
            line.samples(20_000);
            // A broken contact at 2.3 s, which the detector has to find.
            line.bench.set_trouble(trouble);
            assert_eq!(line.until_ended(), state, "run {run}");
            assert_eq!((line.gear().closed, line.gear().fraction), (false, 0.0));
        }
        line.rig.ask(Request::Acknowledge);
        line.samples(1);
        assert_eq!(line.state().state, State::Idle);
    });
}

#[test]
fn a_pass_takes_a_chain_that_was_plausible_throughout() {
    for fault in FAULTS {
        ready(|line| {
            line.rig.shared.raise(fault);
            line.rig.ask(Request::StartRun { run: 1 });
            line.samples(10_000);
            assert_eq!(line.until_ended(), State::Passed, "{fault:?} before the run");
            line.bench = Bench::new().unwrap();
            line.rig.ask(Request::StartRun { run: 2 });
            line.samples(1);
            line.rig.shared.raise(fault);
            assert_eq!(line.until_ended(), State::Unjudged, "{fault:?} with its first sample");
        });
    }
    // A fault that says nothing about the chain.
    ready(|line| {
        line.rig.ask(Request::StartRun { run: 1 });
        line.samples(100);
        line.rig.shared.raise(Fault::BadFrame);
        assert_eq!(line.until_ended(), State::Passed);
    });
}

#[test]
fn the_host_starts_and_stops_and_disturbs_nothing() {
    ready(|line| {
        assert_eq!(line.rig.ask(Request::StartRun { run: 2 }), Heard::Refused(Refusal::Range));
        assert_eq!(line.rig.ask(Request::StartRun { run: 0 }), Heard::Done, "the last one, asked for again");
        line.samples(10);
        assert_eq!(line.state().state, State::Idle);
        assert_eq!(line.rig.ask(Request::StartRun { run: 1 }), Heard::Done);
        line.samples(3_000);
        let status = line.state();
        assert_eq!((status.state, status.runs, status.elapsed), (State::Running, 1, 2_999));
        assert!((status.command - 2_999.0 / 5_000.0).abs() < 1e-5, "{status:?}");
        assert_eq!((status.abort_closed, status.emergency_closed, status.tripped), (true, true, false));
        // Asked for again, because an answer was lost; and what would end it or take its test away.
        assert_eq!(line.rig.ask(Request::StartRun { run: 1 }), Heard::Done);
        let refused = Heard::Refused(Refusal::Running);
        for request in [
            Request::StartRun { run: 2 },
            Request::BeginTest { test: 7 },
            Request::ClearFaults,
            Request::Restart,
            Request::CommitParameters { fingerprint: 0, length: 0, crc: 0 },
            Request::CommitRig { fingerprint: 0, length: 0, crc: 0 },
        ] {
            assert_eq!(line.rig.ask(request), refused, "{request:?}");
        }
        assert_eq!(line.rig.ask(Request::BeginTest { test: status.test }), Heard::Done, "to follow it");
        assert_eq!(line.rig.ask(Request::Stop), Heard::Done);
        line.samples(1_000);
        assert_eq!((line.state().state, line.state().runs), (State::Running, 1));
        assert_eq!(line.rig.ask(Request::AbortRun), Heard::Done);
        line.samples(1);
        assert_eq!(line.state().state, State::Stopped(Stop::Abort));
        assert_eq!(line.gear().fraction, 0.0);
        assert_eq!(line.rig.ask(Request::StartRun { run: 2 }), Heard::Refused(Refusal::Stopped));
        assert_eq!(line.rig.ask(Request::Acknowledge), Heard::Done);
        line.samples(1);
        assert_eq!(line.rig.ask(Request::StartRun { run: 2 }), Heard::Done);
        line.samples(1);
        assert_eq!(line.state().runs, 2);
    });
}

#[test]
fn a_cut_by_the_hardware_is_latched() {
    ready(|line| {
        line.rig.ask(Request::StartRun { run: 1 });
        line.samples(5_000);
        line.gear().tripped = true;
        line.samples(1);
        assert_eq!((line.state().state, line.gear().arms), (State::Stopped(Stop::OverCurrent), 1));
        line.samples(10_000);
        assert_eq!((line.state().state, line.gear().arms), (State::Stopped(Stop::OverCurrent), 1));
        assert!(line.state().tripped);
        line.rig.ask(Request::Acknowledge);
        line.samples(1);
        assert_eq!((line.state().state, line.gear().arms), (State::Idle, 2), "arming is what an acknowledgement does");
        line.gear().tripped = true;
        line.samples(1);
        assert_eq!((line.state().state, line.gear().arms), (State::Stopped(Stop::OverCurrent), 2));
    });
}

#[test]
fn samples_that_stand_still_stop_a_run_and_nothing_else() {
    ready(|line| {
        line.rig.shared.stand_still();
        line.samples(5);
        assert_eq!(line.state().state, State::Idle);
        line.rig.ask(Request::StartRun { run: 1 });
        line.samples(5_000);
        assert_eq!(line.state().state, State::Running, "what was before is forgotten");
        line.rig.shared.stand_still();
        line.samples(1);
        assert_eq!(line.state().state, State::Stopped(Stop::Sampling));
    });
}

#[test]
fn without_a_sequence_the_supply_stays_off() {
    let high = Some(Supply { wave: WAVE, full_scale_v: 200.0 });
    for (settings, supply) in [(station(), SUPPLY), (with_sequence(), None), (with_sequence(), high)] {
        line(&settings, supply, |line| {
            for request in [Request::RunState, Request::StartRun { run: 1 }, Request::AbortRun, Request::Acknowledge] {
                assert_eq!(line.rig.ask(request), Heard::Refused(Refusal::NoSequence));
            }
            assert_eq!(line.rig.server.state(), None);
            line.press_start();
            line.press_start();
            assert_eq!((line.gear().closed, line.gear().fraction), (false, 0.0));
            // Tests go on as they did.
            assert_eq!(line.rig.ask(Request::BeginTest { test: 1 }), Heard::Done);
        });
    }
    // Safe mode.
    run(Nor::erased(4), |board| {
        let sequence = board.server.take_sequence();
        let mut station = Station::new(sequence, Gear::new(), board.shared);
        let mut bench = Bench::new().unwrap();
        for n in 0..2_000_u32 {
            station.switchgear().contacts.start = n / 500 % 2 == 1;
            let output = board.sampler.sample(bench.counts_at(0.0), 0);
            station.sample(&output, 0);
            assert_eq!((station.switchgear().closed, station.switchgear().fraction), (false, 0.0));
        }
        assert_eq!(board.ask(Request::RunState), Heard::Refused(Refusal::NoSequence));
    });
}

/// What each state shows: only a pass pulses on the pass, only a run on busy; no two of pass, alarm and busy at once.
#[test]
fn lamps_of_a_station() {
    let rate = NUCLEO_G474RE.sample_rate_hz;
    for state in State::ALL {
        let shown: Vec<Lamps> = (0..rate).map(|n| Lamps::of_run(state, n, &NUCLEO_G474RE)).collect();
        let edges = |of: fn(&Lamps) -> bool| shown.windows(2).filter(|pair| of(&pair[0]) != of(&pair[1])).count();
        let pulses = |of: fn(&Lamps) -> bool| match edges(of) {
            0 => false,
            n => {
                assert!(n.abs_diff(2 * PULSES_HZ as usize) <= 1, "{state:?}: {n} edges");
                true
            }
        };
        assert_eq!(pulses(|lamps| lamps.pass), state == State::Passed, "{state:?}");
        assert_eq!(pulses(|lamps| lamps.busy), state.is_busy(), "{state:?}");
        assert_eq!(pulses(|lamps| lamps.status), matches!(state, State::Stopped(_)), "{state:?}");
        assert!(shown.iter().all(|lamps| lamps.alarm == (state == State::Failed)), "{state:?}");
        assert!(shown.iter().all(|l| u8::from(l.pass) + u8::from(l.alarm) + u8::from(l.busy) <= 1), "{state:?}");
    }
    // Where somebody else switches the motor, nothing is busy.
    for verdict in [Verdict::Pass, Verdict::Fail, Verdict::CannotJudge] {
        assert!((0..rate).all(|n| !Lamps::of(verdict, n, &NUCLEO_G474RE).busy));
    }
}
