//! From a profile of the virtual rig to what the board commands, and what it cannot.

use std::path::{Path, PathBuf};

use greyrig::detector::Verdict;
use greyrig::hardware::NUCLEO_G474RE;
use greyrig::parameters;
use greyrig::sequence::{Contacts, Seen, State, Supply, Wave, Wishes};
use greyrig::units::CalibrationSettings;
use greyrig_host::device::sequence::{in_words, read, suits, supply};
use greyrig_host::error::Result;
use greyrig_host::model::Kind;
use greyrig_host::rig::source::{Drive, Shape};
use greyrig_host::rig::{Motor, Profile};

const LIMITS: &str = "trip_a = 30.0\noverspeed_rad_s = 4500.0\nrest_rad_s = 50.0\ntime_out_s = 100.0\n\
    [stuck]\nfrom_v = 150.0\nbelow_rad_s = 20.0\nwithin_s = 1.0\n";

fn file(folder: &Path, head: &str) -> PathBuf {
    let path = folder.join("sequence.toml");
    // Tables come after everything else.
    let (own, tables) = head.split_at(head.find("[[").unwrap_or(head.len()));
    let (limits, stuck) = LIMITS.split_at(LIMITS.find('[').unwrap());
    std::fs::write(&path, format!("{own}{limits}{stuck}{tables}")).unwrap();
    path
}

fn of(head: &str, kind: Kind) -> Result<greyrig::sequence::Settings> {
    let folder = tempfile::tempdir().unwrap();
    read(&file(folder.path(), head), kind)
}

/// What the board commands, sample by sample, is the amplitude that the virtual rig's source has.
#[test]
fn the_board_commands_what_the_rig_simulates() {
    for (profile, seconds) in
        [("steady", 7.0), ("staircase", 5.3), ("coast-down", 4.0), ("ramp", 3.7), ("dc-steps", 2.9)]
    {
        let settings = of(&format!("profile = \"{profile}\"\nseconds = {seconds}\n"), Kind::Universal).unwrap();
        let supply = Supply { wave: settings.wave, full_scale_v: 326.0 };
        let calibration = CalibrationSettings::default().build().unwrap();
        let mut sequence = settings.build(&supply, &calibration, &NUCLEO_G474RE).unwrap();
        let contacts = Contacts { start: false, abort_closed: true, emergency_closed: true };
        let mut seen = Seen {
            samples: 1,
            contacts,
            tripped: false,
            stood_still: false,
            speed: 100.0,
            wishes: Wishes::default(),
            verdict: Verdict::CannotJudge,
        };
        (0..100).for_each(|_| assert!(!sequence.step(&seen).closed));
        seen.wishes.acknowledge = true;
        sequence.step(&seen);
        seen.wishes = Wishes { start: true, ..Wishes::default() };
        let mut command = sequence.step(&seen);
        seen.wishes = Wishes::default();
        assert_eq!(sequence.state(), State::Running);
        let motor = Motor::nominal(greyrig_host::rig::motor::Kind::Universal);
        for segment in Profile::find(profile).unwrap().segments(&motor, 50.0, seconds).unwrap() {
            let (Shape::Ac { from_v, to_v, .. } | Shape::Dc { from_v, to_v }) = segment.shape;
            let samples = (segment.seconds * 1e4).round() as u32;
            for n in 0..samples {
                let off = segment.drive == Drive::Off;
                let volts = if off { 0.0 } else { from_v + (to_v - from_v) * f64::from(n) / f64::from(samples) };
                // Single precision, and a slope that is counted up to 60,000 samples: some ten of its steps of 326 V.
                assert!((f64::from(326.0 * command.fraction) - volts).abs() < 1e-3, "{profile} {n}: {volts} V");
                assert_eq!(command.closed, !off, "{profile} {n}");
                command = sequence.step(&seen);
            }
        }
        assert_eq!(sequence.state(), State::Settling, "{profile}: no sample more");
    }
}

#[test]
fn segments_of_ones_own() {
    let own = "wave = \"direct\"\n[[segment]]\nseconds = 1.0\nfrom_v = 0.0\nto_v = 24.0\n\
        [[segment]]\nseconds = 0.5\nfrom_v = 24.0\nto_v = 24.0\noff = true\n";
    let settings = of(own, Kind::PmDc).unwrap();
    assert_eq!((settings.wave, settings.seconds()), (Wave::Direct, 1.5));
    assert_eq!(settings.segments.len(), 2);
    let scaled = of("profile = \"steady\"\npeak_voltage_v = 100.0\nmains_hz = 60.0\n", Kind::Universal).unwrap();
    assert_eq!(scaled.wave, Wave::Alternating { frequency_hz: 60.0 });
    assert_eq!(scaled.segments.iter().map(|s| s.to_v).fold(0.0, f32::max), 100.0);
}

#[test]
fn what_the_board_cannot_do_is_told() {
    let many = "[[segment]]\nseconds = 0.1\nfrom_v = 1.0\nto_v = 1.0\n".repeat(25);
    for (head, kind, words) in [
        ("profile = \"locked\"\n", Kind::Universal, "nobody holds the rotor"),
        ("profile = \"phase-angle\"\n", Kind::Universal, "no firing angle"),
        ("profile = \"dc-steps\"\n", Kind::PmDc, "one sign"),
        ("profile = \"stairs\"\n", Kind::Universal, "stairs"),
        ("profile = \"steady\"\nwave = \"direct\"\n", Kind::Universal, "not both"),
        ("wave = \"direct\"\nseconds = 3.0\n", Kind::Universal, "not both"),
        ("", Kind::Universal, "not both"),
        ("wave = \"direct\"\n", Kind::Universal, "no segment"),
        ("profile = \"steady\"\nhurry = true\n", Kind::Universal, "hurry"),
        ("profile = \"steady\"\nseconds = 99.99\n", Kind::Universal, "time-out"),
        (&format!("wave = \"direct\"\n{many}"), Kind::Universal, "25 segments"),
    ] {
        let told = of(head, kind).expect_err(head);
        assert!(told.to_string().contains(words), "{head}: {told}");
        assert_eq!(told.exit_code(), 2);
    }
}

#[test]
fn a_supply_and_whether_it_suits() {
    let alternating = supply("ac:325:50").unwrap();
    assert_eq!(alternating, Supply { wave: Wave::Alternating { frequency_hz: 50.0 }, full_scale_v: 325.0 });
    assert_eq!(supply("dc:60").unwrap(), Supply { wave: Wave::Direct, full_scale_v: 60.0 });
    assert_eq!(
        [in_words(&alternating), in_words(&supply("dc:60").unwrap())],
        ["50 Hz, 0 to 325 V peak", "direct, 0 to 60 V"]
    );
    for text in ["", "ac", "ac:325", "ac:325:0", "dc:-1", "dc:60:50", "dc:x", "rf:1:2", "ac:nan:50"] {
        assert!(supply(text).is_err(), "{text}");
    }
    let sequence = of("profile = \"steady\"\npeak_voltage_v = 300.0\n", Kind::Universal).unwrap();
    let settings = parameters::Settings { sequence: Some(sequence), ..parameters::Settings::default() };
    let rig = |supply| parameters::Rig { supply, ..parameters::Rig::default() };
    assert!(suits(&settings, &rig(Some(alternating))).is_ok());
    assert!(suits(&parameters::Settings::default(), &rig(None)).is_ok(), "nothing to be run");
    for (supply, words) in [
        (None, "no supply"),
        (Some(Supply { full_scale_v: 200.0, ..alternating }), "asks for more"),
        (Some(Supply { wave: Wave::Direct, ..alternating }), "another kind"),
    ] {
        let told = suits(&settings, &rig(supply)).expect_err(words).to_string();
        assert!(told.contains(words), "{told}");
    }
}
