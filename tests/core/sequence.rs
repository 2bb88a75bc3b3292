//! The station's sequence: every event in every state, any stream of what may be seen, and what its settings refuse.

use greyrig::detector::Verdict;
use greyrig::hardware::NUCLEO_G474RE;
use greyrig::parameters::block::MAX_PAYLOAD;
use greyrig::parameters::rig::MAX_RIG;
use greyrig::parameters::section::{decode, encode};
use greyrig::parameters::{Error, Rig, Settings as Parameters, Tag};
use greyrig::sequence::contact::{Button, Contact};
use greyrig::sequence::table::next;
use greyrig::sequence::{
    Command, Contacts, Event, MAX_SEGMENTS, Seen, Segment, Sequence, Settings, SettingsError, State, Stop, Stuck,
    Supplied, Supply, Wave, Wishes,
};
use greyrig::units::CalibrationSettings;
use proptest::prelude::*;

/// Samples a second.
const RATE: u32 = NUCLEO_G474RE.sample_rate_hz;
/// Samples after which a stop has to be noticed, docs/sequence.md: 2 ms.
const STOP: u32 = 20;
/// Samples after which START counts: 20 ms.
const START: u32 = 200;
/// Samples after which overspeed is noticed: 1 ms.
const OVERSPEED: u32 = 10;
/// Samples that the last periods are given: 50 ms.
const JUDGING: u32 = 500;

const SUPPLY: Supply = Supply { wave: Wave::Alternating { frequency_hz: 50.0 }, full_scale_v: 325.0 };

fn segment(seconds: f32, from_v: f32, to_v: f32) -> Segment {
    Segment { seconds, from_v, to_v, supplied: Supplied::On }
}

/// 30 ms up to 130 V, 20 ms of it, 10 ms open, 40 ms down from 260 V.
fn settings() -> Settings {
    let off = Segment { supplied: Supplied::Off, ..segment(0.01, 130.0, 130.0) };
    Settings {
        wave: SUPPLY.wave,
        segments: [segment(0.03, 0.0, 130.0), segment(0.02, 130.0, 130.0), off, segment(0.04, 260.0, 65.0)]
            .into_iter()
            .collect(),
        trip_a: 25.0,
        overspeed_rad_s: 4000.0,
        stuck: Stuck { from_v: 65.0, below_rad_s: 20.0, within_s: 0.03 },
        rest_rad_s: 10.0,
        time_out_s: 0.5,
    }
}

/// Samples of the profile.
const PROFILE: u32 = 1000;

fn built(settings: &Settings) -> Result<Sequence, SettingsError> {
    settings.build(&SUPPLY, &CalibrationSettings::default().build().unwrap(), &NUCLEO_G474RE)
}

/// Everything is as it should be, at a speed.
fn well(speed: f32) -> Seen {
    Seen {
        samples: 1,
        contacts: Contacts { start: false, abort_closed: true, emergency_closed: true },
        tripped: false,
        stood_still: false,
        speed,
        wishes: Wishes::default(),
        verdict: Verdict::CannotJudge,
    }
}

fn start() -> Seen {
    Seen { wishes: Wishes { start: true, ..Wishes::default() }, ..well(0.0) }
}

fn acknowledge() -> Seen {
    Seen { wishes: Wishes { acknowledge: true, ..Wishes::default() }, ..well(0.0) }
}

fn abort() -> Seen {
    Seen { wishes: Wishes { abort: true, ..Wishes::default() }, ..well(0.0) }
}

fn steps(sequence: &mut Sequence, seen: Seen, samples: u32) -> Command {
    (0..samples).fold(Command::default(), |_, _| sequence.step(&seen))
}

/// One whose contacts have been closed for long enough, and that has been acknowledged.
fn idle() -> Sequence {
    let mut sequence = built(&settings()).unwrap();
    steps(&mut sequence, well(0.0), 2 * START);
    sequence.step(&acknowledge());
    assert_eq!(sequence.state(), State::Idle);
    sequence
}

/// One that is in a state, by what leads there.
fn in_state(state: State) -> Sequence {
    let mut sequence = idle();
    let run = |sequence: &mut Sequence, verdict| {
        sequence.step(&start());
        steps(sequence, well(100.0), PROFILE);
        assert_eq!(sequence.state(), State::Settling);
        steps(sequence, Seen { verdict, ..well(0.0) }, JUDGING);
    };
    match state {
        State::Idle => {}
        State::Running => drop(sequence.step(&start())),
        State::Settling => {
            sequence.step(&start());
            steps(&mut sequence, well(100.0), PROFILE);
        }
        State::Passed => run(&mut sequence, Verdict::Pass),
        State::Failed => run(&mut sequence, Verdict::Fail),
        State::Unjudged => run(&mut sequence, Verdict::CannotJudge),
        State::Stopped(Stop::Power) => {
            sequence = built(&settings()).unwrap();
            // Closed contacts have not been told yet; then they have.
            steps(&mut sequence, well(0.0), 2 * START);
        }
        State::Stopped(stop) => {
            sequence.step(&start());
            bring(&mut sequence, stop);
            // The cause is over.
            steps(&mut sequence, well(100.0), 2 * START);
        }
    }
    assert_eq!(sequence.state(), state);
    sequence
}

/// Does to it what ends in a stop, from whatever state; gives the samples that it took.
fn bring(sequence: &mut Sequence, stop: Stop) -> u32 {
    let (seen, most) = match stop {
        Stop::Power => return 0,
        Stop::EmergencyStop => {
            (Seen { contacts: Contacts { emergency_closed: false, ..well(0.0).contacts }, ..well(100.0) }, STOP)
        }
        Stop::OverCurrent => (Seen { tripped: true, ..well(100.0) }, 1),
        Stop::OverSpeed => (well(-4001.0), OVERSPEED),
        Stop::Sampling => (Seen { samples: 11, ..well(100.0) }, 1),
        Stop::Abort => (Seen { contacts: Contacts { abort_closed: false, ..well(0.0).contacts }, ..well(100.0) }, STOP),
        // From 65 V on, which the ramp reaches after 15 ms, for 30 ms.
        Stop::StuckRotor => (well(19.9), 150 + 300 + 1),
        // It never comes to rest.
        Stop::TimeOut => (well(100.0), 5001),
    };
    for n in 1..=most {
        sequence.step(&seen);
        if sequence.state() == State::Stopped(stop) {
            return n;
        }
    }
    most + 1
}

/// The table as the documentation shows it: the state after an event, by their names; none: it stays.
fn documented(state: State, event: Event) -> Option<&'static str> {
    let page = include_str!("../../docs/sequence.md");
    let cells = |line: &'static str| line.trim_matches('|').split('|').map(str::trim).collect::<Vec<_>>();
    let mut rows = page.lines().filter(|line| line.starts_with('|')).map(cells);
    let head = rows.by_ref().find(|row| row[0] == "state").expect("the table");
    let column = head.iter().position(|name| *name == event.name()).unwrap_or_else(|| panic!("no column {event:?}"));
    let row = rows.find(|row| row[0] == state.name()).unwrap_or_else(|| panic!("no row {state:?}"));
    Some(row[column]).filter(|cell| *cell != "–")
}

#[test]
fn the_table_is_the_documented_one() {
    for state in State::ALL {
        for event in Event::ALL {
            let after = next(state, event);
            assert_eq!(after.name(), documented(state, event).unwrap_or(state.name()), "{state:?}, {event:?}");
            match (state, event) {
                (State::Stopped(first), Event::Stop(_)) => assert_eq!(after, State::Stopped(first), "the first counts"),
                (_, Event::Stop(stop)) => assert_eq!(after, State::Stopped(stop)),
                _ if documented(state, event).is_none() => assert_eq!(after, state),
                _ => {}
            }
        }
        assert_eq!(State::from_code(state.code()), state);
    }
    assert_eq!(State::from_code(14), State::Stopped(Stop::Power));
    for (n, stop) in Stop::ALL.into_iter().enumerate() {
        assert_eq!(stop as usize, n);
    }
}

/// What makes each event, in each state of a sequence at work: the state after it, and the command with that very
/// sample.
#[test]
fn every_event_in_every_state() {
    for state in State::ALL {
        for event in Event::ALL {
            let mut sequence = in_state(state);
            let busy = matches!(state, State::Running | State::Settling);
            let held = |seen: Seen, samples| (seen, samples);
            let (seen, samples) = match event {
                Event::Stop(Stop::Power) => continue,
                Event::Stop(Stop::EmergencyStop) => held(
                    Seen { contacts: Contacts { emergency_closed: false, ..well(0.0).contacts }, ..well(100.0) },
                    STOP,
                ),
                Event::Stop(Stop::Abort) => held(abort(), 1),
                Event::Stop(Stop::OverCurrent) => held(Seen { tripped: true, ..well(100.0) }, 1),
                Event::Stop(Stop::OverSpeed) => held(well(f32::NAN), OVERSPEED),
                // What only a run can be stopped by.
                Event::Stop(Stop::Sampling) if busy => held(Seen { stood_still: true, ..well(100.0) }, 1),
                Event::Stop(Stop::StuckRotor) if state == State::Running => held(well(19.9), 450),
                Event::Stop(Stop::TimeOut) if busy => held(well(100.0), 5001 - sequence.elapsed()),
                Event::Stop(_) => continue,
                Event::Acknowledge => held(acknowledge(), 1),
                Event::Start => held(start(), 1),
                Event::ProfileEnded if state == State::Running => held(well(100.0), PROFILE),
                Event::Passes if state == State::Settling => {
                    held(Seen { verdict: Verdict::Pass, ..well(0.0) }, JUDGING)
                }
                Event::Fails if state == State::Settling => held(Seen { verdict: Verdict::Fail, ..well(0.0) }, JUDGING),
                Event::CannotJudge if state == State::Settling => held(well(0.0), JUDGING),
                // Elsewhere what would bring them changes nothing, but in time.
                Event::ProfileEnded | Event::Passes | Event::Fails | Event::CannotJudge if busy => continue,
                Event::ProfileEnded => held(well(100.0), PROFILE + 1),
                Event::Passes => held(Seen { verdict: Verdict::Pass, ..well(0.0) }, JUDGING + 1),
                Event::Fails => held(Seen { verdict: Verdict::Fail, ..well(0.0) }, JUDGING + 1),
                Event::CannotJudge => held(well(0.0), JUDGING + 1),
            };
            // Not a sample before.
            for n in 1..samples {
                sequence.step(&seen);
                let early = sequence.state();
                let ended = matches!((event, early), (Event::Stop(Stop::TimeOut), State::Settling));
                assert!(early == state || ended, "{state:?}, {event:?}: {early:?} after {n}");
            }
            let command = sequence.step(&seen);
            assert_eq!(
                sequence.state().name(),
                documented(state, event).unwrap_or(state.name()),
                "{state:?}, {event:?}"
            );
            if sequence.state() != State::Running {
                assert_eq!((command.closed, command.fraction), (false, 0.0), "{state:?}, {event:?}");
            }
            let from_stop = matches!(state, State::Stopped(_));
            assert_eq!(command.arm, from_stop && event == Event::Acknowledge, "{state:?}, {event:?}");
            let begins = state != State::Running && sequence.state() == State::Running;
            assert_eq!(command.begin, begins, "{state:?}, {event:?}");
        }
    }
}

/// The command is the profile's straight lines, sample by sample, and nothing after its end.
#[test]
fn the_command_is_the_profile() {
    let mut sequence = idle();
    let mut command = sequence.step(&start());
    assert!(command.begin);
    for n in 0..PROFILE {
        let t = f64::from(n) / f64::from(RATE);
        let (volts, closed) = match t {
            t if n < 300 => (130.0 * t / 0.03, true),
            _ if n < 500 => (130.0, true),
            _ if n < 600 => (0.0, false),
            t => (260.0 + (65.0 - 260.0) * (t - 0.06) / 0.04, true),
        };
        // Three roundings of single precision.
        assert!((f64::from(command.fraction) - volts / 325.0).abs() < 3e-7, "{n}: {command:?}, {volts} V");
        assert_eq!(command.closed, closed, "{n}");
        command = sequence.step(&well(100.0));
        assert!(!command.begin);
    }
    assert_eq!((sequence.state(), command), (State::Settling, Command::default()));
    // The next run begins at its begin.
    let mut again = in_state(State::Failed);
    assert_eq!(again.step(&start()).fraction, 0.0);
    assert!((again.step(&well(100.0)).fraction - 130.0 / 325.0 / 300.0).abs() < 1e-7);
}

/// Samples that were not taken are part of the time.
#[test]
fn time_is_counted_with_the_samples_that_were_missed() {
    let mut sequence = idle();
    sequence.step(&start());
    let two = Seen { samples: 2, ..well(100.0) };
    let command = steps(&mut sequence, two, 100);
    assert!((command.fraction - 130.0 / 325.0 * 200.0 / 300.0).abs() < 1e-6, "{command:?}");
    // Over the end of two segments at once, which is allowed for ten samples.
    steps(&mut sequence, Seen { samples: 10, ..well(100.0) }, 39);
    let command = sequence.step(&Seen { samples: 10, ..well(100.0) });
    assert_eq!((sequence.elapsed(), command.closed), (600, true));
    assert_eq!(bring(&mut sequence, Stop::Sampling), 1);
}

/// From the first sample of the cause on, in time, whatever the station does.
#[test]
fn every_stop_comes_in_time() {
    for (stop, most) in
        [(Stop::EmergencyStop, STOP), (Stop::OverCurrent, 1), (Stop::OverSpeed, OVERSPEED), (Stop::Abort, STOP)]
    {
        for state in State::ALL.into_iter().filter(|state| !matches!(state, State::Stopped(_))) {
            assert_eq!(bring(&mut in_state(state), stop), most, "{stop:?}, {state:?}");
        }
    }
    // At every sample of a run.
    for at in 0..PROFILE + JUDGING {
        let mut sequence = idle();
        sequence.step(&start());
        steps(&mut sequence, well(100.0), at);
        let open = Seen { contacts: Contacts { emergency_closed: false, ..well(0.0).contacts }, ..well(100.0) };
        let command = steps(&mut sequence, open, STOP);
        assert_eq!((sequence.state(), command), (State::Stopped(Stop::EmergencyStop), Command::default()), "{at}");
    }
    let mut stuck = in_state(State::Running);
    assert_eq!(bring(&mut stuck, Stop::StuckRotor), 150 + 300);
    let mut late = in_state(State::Running);
    assert_eq!(bring(&mut late, Stop::TimeOut), 5001);
}

/// Of several causes in one sample the first of the list counts.
#[test]
fn the_first_of_several_stops_counts() {
    let open = Contacts { start: true, abort_closed: false, emergency_closed: false };
    let mut all = Seen { contacts: open, tripped: true, stood_still: true, ..well(f32::NAN) };
    let stops = [Stop::EmergencyStop, Stop::OverCurrent, Stop::OverSpeed, Stop::Sampling, Stop::Abort];
    for (n, stop) in stops.into_iter().enumerate() {
        match n {
            1 => all.contacts.emergency_closed = true,
            2 => all.tripped = false,
            3 => all.speed = 100.0,
            4 => all.stood_still = false,
            _ => {}
        }
        let mut sequence = in_state(State::Running);
        // Both contacts and the speed are noticed with one and the same sample.
        let quiet = |seen: Seen| Seen { tripped: false, stood_still: false, ..seen };
        let only = |contacts| Seen { contacts, ..well(100.0) };
        steps(&mut sequence, only(all.contacts), STOP - OVERSPEED);
        steps(&mut sequence, quiet(all), OVERSPEED - 1);
        assert_eq!(sequence.state(), State::Running);
        sequence.step(&all);
        assert_eq!(sequence.state(), State::Stopped(stop));
    }
}

/// At the very speed a rotor turns, and below the voltage nobody asks for it.
#[test]
fn a_rotor_is_stuck_below_its_speed_and_above_its_voltage() {
    let mut sequence = in_state(State::Running);
    steps(&mut sequence, well(20.0), PROFILE);
    assert_eq!(sequence.state(), State::Settling, "it turns");
    // 65 V from sample 150 on; then 290 of the 300 samples, a turn, and anew.
    let mut sequence = in_state(State::Running);
    steps(&mut sequence, well(0.0), 150 + 290);
    steps(&mut sequence, well(-20.0), 1);
    steps(&mut sequence, well(0.0), 55);
    assert_eq!(sequence.state(), State::Running);
    // What was so in a run is forgotten in the next.
    sequence.step(&abort());
    sequence.step(&acknowledge());
    sequence.step(&start());
    assert_eq!(bring(&mut sequence, Stop::StuckRotor), 150 + 300);
}

#[test]
fn nothing_goes_on_by_itself_and_nothing_while_the_cause_lasts() {
    // Power has come: START acknowledges, a second one starts.
    let mut sequence = in_state(State::Stopped(Stop::Power));
    sequence.step(&start());
    assert_eq!(sequence.state(), State::Stopped(Stop::Power), "the host's start does not acknowledge");
    let pressed = Seen { contacts: Contacts { start: true, ..well(0.0).contacts }, ..well(0.0) };
    steps(&mut sequence, pressed, START - 1);
    assert_eq!(sequence.state(), State::Stopped(Stop::Power));
    assert!(sequence.step(&pressed).arm);
    assert_eq!(sequence.state(), State::Idle);
    steps(&mut sequence, pressed, 10 * START);
    assert_eq!(sequence.state(), State::Idle, "a button that is held");
    steps(&mut sequence, well(0.0), START);
    steps(&mut sequence, pressed, START);
    assert_eq!(sequence.state(), State::Running);
    // A contact that stays open.
    for seen in [
        Seen { contacts: Contacts { emergency_closed: false, ..well(0.0).contacts }, ..well(0.0) },
        Seen { contacts: Contacts { abort_closed: false, ..well(0.0).contacts }, ..well(0.0) },
    ] {
        let mut sequence = idle();
        steps(&mut sequence, seen, STOP);
        let stopped = sequence.state();
        assert!(matches!(stopped, State::Stopped(_)));
        let wishes = Wishes { acknowledge: true, start: true, ..Wishes::default() };
        steps(&mut sequence, Seen { wishes, ..seen }, 10);
        assert_eq!(sequence.state(), stopped);
        // It is over: still stopped, and what was wished for meanwhile is not done now.
        steps(&mut sequence, well(0.0), 10 * STOP);
        assert_eq!(sequence.state(), stopped);
        sequence.step(&acknowledge());
        assert_eq!(sequence.state(), State::Idle);
    }
    // A hardware that stays cut: arming is what an acknowledgement does, and it trips anew.
    let mut sequence = in_state(State::Running);
    let tripped = Seen { tripped: true, ..well(0.0) };
    assert_eq!(sequence.step(&tripped), Command::default());
    let again = Seen { wishes: acknowledge().wishes, ..tripped };
    assert_eq!(sequence.step(&again), Command { arm: true, ..Command::default() });
    assert_eq!((sequence.step(&tripped), sequence.state()), (Command::default(), State::Stopped(Stop::OverCurrent)));
    // A start within the sample of a stop is forgotten.
    let mut sequence = idle();
    sequence.step(&Seen { wishes: Wishes { start: true, abort: true, ..Wishes::default() }, ..well(0.0) });
    sequence.step(&acknowledge());
    steps(&mut sequence, well(0.0), 100);
    assert_eq!(sequence.state(), State::Idle);
}

#[test]
fn contacts_debounce_and_open_wires_stop() {
    let mut contact = Contact::new(STOP);
    assert!(contact.look(true), "open until it has been closed");
    for n in 2..=2 * STOP {
        assert_eq!(contact.look(true), n < 2 * STOP, "{n}");
    }
    // Short openings with enough time between them.
    for _ in 0..50 {
        assert!((0..STOP - 1).all(|_| !contact.look(false)));
        assert!((0..2 * STOP).all(|_| !contact.look(true)));
    }
    // A contact that chatters: every other sample is open.
    let chatter = (0..).position(|n| contact.look(n % 2 == 0)).unwrap() as u32;
    assert!(chatter <= 4 * STOP, "{chatter}");
    // Less than a third of the time: a wire beside a switching relay.
    let mut contact = Contact::new(STOP);
    assert_eq!((0..2 * STOP).filter(|_| contact.look(true)).count() as u32, 2 * STOP - 1);
    assert!((0..10_000).all(|n| !contact.look(n % 4 != 0)));

    let mut button = Button::new(START);
    assert!((0..10 * START).all(|_| !button.look(true)), "one that hangs when power comes");
    assert!((0..START).all(|_| !button.look(false)));
    // Bouncing begins anew each time.
    assert!((0..10 * START).all(|n| !button.look(n % START != 0)));
    assert!(!button.look(false));
    assert!((1..START).all(|_| !button.look(true)));
    assert!(button.look(true));
    assert!((0..10 * START).all(|_| !button.look(true)), "once");
}

#[test]
fn a_pass_takes_a_rotor_at_rest() {
    let mut sequence = in_state(State::Settling);
    let pass = |speed| Seen { verdict: Verdict::Pass, ..well(speed) };
    steps(&mut sequence, pass(10.0), 2 * JUDGING);
    assert_eq!(sequence.state(), State::Settling, "it turns");
    steps(&mut sequence, pass(f32::NAN), OVERSPEED - 1);
    assert_eq!(sequence.state(), State::Settling, "nobody knows");
    sequence.step(&pass(9.9));
    assert_eq!(sequence.state(), State::Passed);
}

/// A short one: its second half by chance.
fn seen() -> impl Strategy<Value = Seen> {
    let often = |rare: f64| prop::bool::weighted(1.0 - rare);
    (
        prop_oneof![30 => Just(1_u32), 1 => 2_u32..14],
        (prop::bool::weighted(0.3), often(0.02), often(0.02)),
        (prop::bool::weighted(0.003), prop::bool::weighted(0.003)),
        prop_oneof![10 => 0.0_f32..9.0, 10 => 15.0_f32..3000.0, 1 => 3990.0_f32..5000.0, 1 => Just(f32::NAN)],
        (prop::bool::weighted(0.1), prop::bool::weighted(0.01), prop::bool::weighted(0.2)),
        prop_oneof![Just(Verdict::Pass), Just(Verdict::Fail), Just(Verdict::CannotJudge)],
    )
        .prop_map(
            |(samples, (start, abort_closed, emergency_closed), (tripped, stood_still), speed, wishes, verdict)| Seen {
                samples,
                contacts: Contacts { start, abort_closed, emergency_closed },
                tripped,
                stood_still,
                speed,
                wishes: Wishes { start: wishes.0, abort: wishes.1, acknowledge: wishes.2 },
                verdict,
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    /// Stretches of what may be seen, some held for long, on a sequence that is in some state.
    #[test]
    fn any_stream_keeps_what_is_promised(
        from in 0..State::ALL.len(),
        stretches in prop::collection::vec((seen(), prop_oneof![3 => 1_u32..30, 2 => 200_u32..900]), 1..40),
    ) {
        let mut sequence = in_state(State::ALL[from]);
        // Samples in a row, as this test counts them.
        let (mut emergency, mut abort, mut fast) = (0, 0, 0);
        let mut since_start = u64::from(sequence.elapsed());
        for (seen, held) in stretches {
            // A wish is told once, not for as long as everything else stays as it is.
            for n in 0..held {
                let seen = if n == 0 { seen } else { Seen { wishes: Wishes::default(), ..seen } };
                let before = sequence.state();
                let command = sequence.step(&seen);
                let after = sequence.state();
                since_start = if command.begin { 0 } else { since_start + u64::from(seen.samples) };
                emergency = if seen.contacts.emergency_closed { 0 } else { emergency + 1 };
                abort = if seen.contacts.abort_closed { 0 } else { abort + 1 };
                fast = if seen.speed.abs() <= 4000.0 { 0 } else { fast + 1 };
                // Never voltage but in a run.
                if after != State::Running {
                    prop_assert!(!command.closed && command.fraction == 0.0, "{after:?}: {command:?}");
                }
                prop_assert!((0.0..=0.8).contains(&command.fraction), "260 V at most: {command:?}");
                prop_assert!(command.closed || command.fraction == 0.0);
                // Every cause in its time.
                let wrong = emergency >= STOP || abort >= STOP || fast >= OVERSPEED || seen.wishes.abort
                    || (seen.tripped && !matches!(before, State::Stopped(_)));
                let busy = matches!(before, State::Running | State::Settling);
                let missed = busy && (seen.stood_still || seen.samples > 10);
                let late = busy && since_start > 5000;
                if wrong || missed || late {
                    prop_assert!(matches!(after, State::Stopped(_)), "{before:?} to {after:?} with {seen:?}");
                }
                // A stop is left by an acknowledgement alone, and to rest.
                if let State::Stopped(stop) = before {
                    prop_assert!(matches!(after, State::Idle) || after == State::Stopped(stop));
                    prop_assert!(after != State::Idle || seen.wishes.acknowledge || seen.contacts.start);
                    prop_assert_eq!(command.arm, after == State::Idle);
                } else {
                    prop_assert!(!command.arm);
                }
                // A run begins where one is asked for, and with a test.
                if after == State::Running && before != State::Running {
                    prop_assert!(command.begin && (seen.wishes.start || seen.contacts.start), "{before:?}");
                    prop_assert!(matches!(before, State::Idle | State::Passed | State::Failed | State::Unjudged));
                } else {
                    prop_assert!(!command.begin);
                }
                // A verdict belongs to a whole run, and is the one that was told.
                if after != before && matches!(after, State::Passed | State::Failed | State::Unjudged) {
                    prop_assert_eq!(before, State::Settling);
                    prop_assert!(since_start >= u64::from(PROFILE + JUDGING), "{since_start}");
                    let told = match seen.verdict {
                        Verdict::Pass => State::Passed,
                        Verdict::Fail => State::Failed,
                        Verdict::CannotJudge => State::Unjudged,
                    };
                    prop_assert_eq!(after, told);
                }
                if after == State::Settling && before != State::Settling {
                    prop_assert!(before == State::Running && since_start >= u64::from(PROFILE));
                }
            }
        }
    }
}

#[test]
fn settings_that_cannot_be_are_refused_by_name() {
    let refused = |change: &dyn Fn(&mut Settings)| {
        let mut settings = settings();
        change(&mut settings);
        built(&settings).map(|_| ()).expect_err("it is refused")
    };
    assert_eq!(refused(&|s| s.segments.clear()), SettingsError::Empty);
    for seconds in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(refused(&|s| s.segments[1].seconds = seconds), SettingsError::Segment(1));
    }
    for volts in [-1.0, f32::NAN, 10_001.0] {
        assert_eq!(refused(&|s| s.segments[2].from_v = volts), SettingsError::Segment(2));
        assert_eq!(refused(&|s| s.segments[3].to_v = volts), SettingsError::Segment(3));
    }
    assert_eq!(refused(&|s| s.segments[0].seconds = 3601.0), SettingsError::TooLong);
    assert_eq!(refused(&|s| s.wave = Wave::Alternating { frequency_hz: f32::NAN }), SettingsError::Frequency);
    assert_eq!(refused(&|s| s.wave = Wave::Alternating { frequency_hz: 60.0 }), SettingsError::OtherWave);
    assert_eq!(refused(&|s| s.wave = Wave::Direct), SettingsError::OtherWave);
    assert_eq!(refused(&|s| s.segments[3].from_v = 325.1), SettingsError::TooHigh(3));
    for value in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let limits: [&dyn Fn(&mut Settings); 7] = [
            &|s| s.trip_a = value,
            &|s| s.overspeed_rad_s = value,
            &|s| s.stuck.from_v = value,
            &|s| s.stuck.below_rad_s = value,
            &|s| s.stuck.within_s = value,
            &|s| s.rest_rad_s = value,
            &|s| s.time_out_s = value,
        ];
        for (n, limit) in limits.into_iter().enumerate() {
            assert!(matches!(refused(limit), SettingsError::Limit(_)), "{n}: {value}");
        }
    }
    assert_eq!(refused(&|s| s.time_out_s = 0.149), SettingsError::TimeOut);
    // ±40 A and 5000 rad/s are what the usual channels show.
    assert_eq!(refused(&|s| s.trip_a = 40.1), SettingsError::Unmeasurable("the current that trips"));
    assert_eq!(refused(&|s| s.overspeed_rad_s = 5001.0), SettingsError::Unmeasurable("the highest speed"));
    for full_scale_v in [0.0, -5.0, f32::NAN, 20_000.0] {
        assert_eq!(Supply { full_scale_v, ..SUPPLY }.validate(), Err(SettingsError::FullScale));
    }
    assert!(Supply { wave: Wave::Alternating { frequency_hz: 0.0 }, ..SUPPLY }.validate().is_err());
    // By hand: 25 A of 0.01953602 A a count around 2047.5.
    let trip = built(&settings()).unwrap().trip();
    assert_eq!(trip, [768, 3327]);
}

fn parameters(sequence: Settings) -> Parameters {
    Parameters { sequence: Some(sequence), ..crate::parameters::settings() }
}

/// The bytes of version 1, written down as those of the other sections are.
#[test]
fn a_sequence_and_a_supply_go_through_the_flash() {
    let full = parameters(settings());
    let payload = encode(&full, &mut [0; MAX_PAYLOAD]).unwrap().to_vec();
    assert_eq!(decode(&payload), Ok(full));
    let mut expected = vec![Tag::Sequence as u8, 1, 86, 0, 1];
    expected.extend(50.0_f32.to_le_bytes());
    expected.push(4);
    for (values, off) in
        [([0.03_f32, 0.0, 130.0], 0), ([0.02, 130.0, 130.0], 0), ([0.01, 130.0, 130.0], 1), ([0.04, 260.0, 65.0], 0)]
    {
        values.iter().for_each(|value| expected.extend(value.to_le_bytes()));
        expected.push(off);
    }
    for value in [25.0_f32, 4000.0, 65.0, 20.0, 0.03, 10.0, 0.5] {
        expected.extend(value.to_le_bytes());
    }
    let length = expected.len() - 4;
    expected[2] = length as u8;
    assert!(payload.windows(expected.len()).any(|window| window == expected), "{payload:?}");

    let rig = Rig { supply: Some(SUPPLY), ..crate::parameters::settings().rig.unwrap() };
    let payload = rig.encode(&mut [0; MAX_RIG]).unwrap().to_vec();
    let mut last = vec![Tag::Supply as u8, 1, 9, 0, 1];
    last.extend(50.0_f32.to_le_bytes());
    last.extend(325.0_f32.to_le_bytes());
    assert!(payload.ends_with(&last));
    assert_eq!(Rig::decode(&payload), Ok(rig.clone()));
    let none = Rig { supply: Some(Supply { full_scale_v: -1.0, ..SUPPLY }), ..rig };
    let payload = none.encode(&mut [0; MAX_RIG]).unwrap().to_vec();
    assert_eq!(Rig::decode(&payload), Err(Error::Sequence(SettingsError::FullScale)));
}

/// A motor's block may be whole, and the rig unable to do it: then there is no sequence, and it is said why.
#[test]
fn a_sequence_needs_a_rig_that_can_do_it() {
    let rig = |supply| Some(Rig { supply, calibration: CalibrationSettings::default(), ..Rig::default() });
    let sequence = |supply, settings| Parameters { rig: rig(supply), ..parameters(settings) }.sequence(&NUCLEO_G474RE);
    assert!(sequence(Some(SUPPLY), settings()).unwrap().is_some());
    assert!(sequence(None, settings()).unwrap().is_none(), "somebody else switches");
    let weak = Supply { full_scale_v: 200.0, ..SUPPLY };
    assert_eq!(sequence(Some(weak), settings()).err(), Some(Error::Sequence(SettingsError::TooHigh(3))));
    assert!(
        Parameters { rig: rig(Some(SUPPLY)), ..crate::parameters::settings() }
            .sequence(&NUCLEO_G474RE)
            .unwrap()
            .is_none()
    );
    // A block with a value that cannot be is refused as a whole.
    let bad = parameters(Settings { time_out_s: -1.0, ..settings() });
    let payload = encode(&bad, &mut [0; MAX_PAYLOAD]).unwrap().to_vec();
    assert!(matches!(decode(&payload), Err(Error::Sequence(SettingsError::Limit("the time-out")))));
}

/// As many segments as there may be, after each other.
#[test]
fn the_longest_list_of_segments_runs() {
    let mut long = settings();
    long.segments = (0..MAX_SEGMENTS).map(|n| segment(1e-3, n as f32, n as f32)).collect();
    let mut sequence = built(&long).unwrap();
    steps(&mut sequence, well(0.0), 2 * START);
    sequence.step(&acknowledge());
    let mut command = sequence.step(&start());
    for n in 0..10 * MAX_SEGMENTS {
        assert_eq!(command.fraction, (n / 10) as f32 / 325.0, "{n}");
        command = sequence.step(&well(100.0));
    }
    assert_eq!(sequence.state(), State::Settling);
}
