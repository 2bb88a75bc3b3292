//! The report's file: well formed, whole in itself, safe against hostile names, within its size.

use greyrig::effects::EffectId;
use greyrig_host::compare::{Comparison, PerSignal};
use greyrig_host::model::{EffectEntry, Parameter, Status};
use greyrig_host::recording::Motion;
use greyrig_host::report::figures::error_falling;
use greyrig_host::report::{Curves, Report, SIGNAL_BUDGET, Step, Table, extremes};
use proptest::prelude::*;

use crate::synthetic_comparison::{comparison, model, recording, servo_traces, traces};

fn empty() -> Comparison {
    Comparison {
        input: None,
        diverges: false,
        esr: PerSignal::default(),
        noise_floor: PerSignal::default(),
        noise_floor_source: None,
        structured: PerSignal::default(),
        one_step: PerSignal::default(),
        per_recording: Vec::new(),
        regions: Vec::new(),
        profiles: Vec::new(),
        maps: Vec::new(),
    }
}

/// The page without its scripts' and styles' content, which follow other rules than markup.
fn markup_only(page: &str) -> String {
    let mut rest = page;
    let mut kept = String::new();
    while let Some(start) = rest.find("<script").into_iter().chain(rest.find("<style")).min() {
        let end_tag = if rest[start..].starts_with("<script") { "</script>" } else { "</style>" };
        let open_ends = start + rest[start..].find('>').expect("the tag ends") + 1;
        let end = open_ends + rest[open_ends..].find(end_tag).expect("the element ends");
        kept.push_str(&rest[..open_ends]);
        rest = &rest[end..];
        kept.push_str(end_tag);
        rest = &rest[end_tag.len()..];
    }
    kept + rest
}

/// Checks that every element is closed in its order, and every attribute quoted.
pub fn assert_well_formed(page: &str) {
    const VOID: [&str; 2] = ["meta", "br"];
    let page = markup_only(page);
    let mut open: Vec<String> = Vec::new();
    for piece in page.split('<').skip(1) {
        let (tag, text) = piece.split_once('>').unwrap_or_else(|| panic!("a tag does not end: {piece:.60}"));
        assert!(!text.contains('>'), "a bare > in the text: {text:.60}");
        assert_eq!(tag.matches('"').count() % 2, 0, "an open quote: {tag:.80}");
        if tag.starts_with('!') {
            continue;
        }
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "closed out of order");
            continue;
        }
        let name = tag.split([' ', '/']).next().unwrap_or_default();
        if !VOID.contains(&name) && !tag.ends_with('/') {
            open.push(name.to_owned());
        }
    }
    assert!(open.is_empty(), "never closed: {open:?}");
}

#[test]
fn a_full_report_is_well_formed_and_whole_in_itself() {
    let (before, mut m) = (comparison(vec![recording("a.csv", traces(3.0))]), model(Motion::Rotary));
    let offset = Parameter { value: 0.003, unit: "N m".into(), ci95: Some([0.002, 0.004]), status: Status::Identified };
    m.effects
        .push(EffectEntry { id: EffectId::TorqueOffset, parameters: [("torque_offset".to_owned(), offset)].into() });
    let after = comparison(vec![recording("b.csv", traces(2.0))]);
    let page = Report::new("Type 462")
        .lead("First sentence.")
        .comparison("Before", &before, &m)
        .comparison("After", &after, &m)
        .waterfall("The error falling", &[Step { label: "base".into(), esr: before.esr }], before.noise_floor)
        .table("A table", Table { caption: "c".into(), columns: vec!["a".into()], rows: vec![vec!["1".into()]] })
        .curves(
            "Training",
            Curves {
                caption: "RMSE".into(),
                x: "epoch".into(),
                y: "RMSE, A".into(),
                logarithmic: true,
                curves: vec![
                    ("training".into(), vec![(0.0, 1.0), (1.0, 0.1)]),
                    ("checking".into(), vec![(0.0, f64::NAN)]),
                ],
            },
        )
        .text("Verdict", "One.\n\nTwo.")
        .recordings(&m.provenance.recordings)
        .fact("Command", "greyrig compare a.csv")
        .html();
    assert_well_formed(&page);

    let markup = markup_only(&page);
    for loading in
        [" src=", "<link", "<iframe", "<object", "<img", "@import", "url(http", " onerror", " onload", " onclick"]
    {
        assert!(!markup.contains(loading), "{loading} in the markup");
    }
    for (at, _) in page.match_indices("http") {
        let here = &page[at..(at + 40).min(page.len())];
        let known = ["http://www.w3.org/2000/svg", "https://github.com/leeoniya/uPlot", "http-equiv"];
        assert!(known.iter().any(|k| here.starts_with(k)), "refers to {here}");
    }
    for href in markup.match_indices("href=\"").map(|(at, found)| &markup[at + found.len()..]) {
        assert!(href.starts_with('#'), "a link that leaves the page: {href:.40}");
    }
    assert!(page.contains("default-src 'none'"));
    for text in [
        "18.3 %",
        "0.810 %",
        "23 times the noise floor",
        "V s/(rad A)",
        "not identifiable",
        "9f86d081884c",
        "current from 9 to 12 A",
    ] {
        assert!(page.contains(text), "{text} is missing");
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let (c, m) = (comparison(vec![recording("a.csv", traces(1.0))]), model(Motion::Rotary));
    let page = || Report::new("x").comparison("c", &c, &m).html();
    assert_eq!(page(), page());
}

#[test]
fn hostile_names_stay_text() {
    let evil = "</script><img src=x onerror=alert(1)>\"'&<!--";
    let mut c = comparison(vec![recording(evil, traces(1.0))]);
    c.per_recording[0].warnings.push(evil.into());
    c.regions[0].text = evil.into();
    c.noise_floor_source = Some(evil.into());
    let mut m = model(Motion::Rotary);
    m.motor = Some(evil.into());
    m.provenance.recordings[0].file = evil.into();
    let steps = [Step { label: evil.into(), esr: c.esr }];
    let page = Report::new(evil)
        .lead(evil)
        .comparison(evil, &c, &m)
        .waterfall(evil, &steps, c.noise_floor)
        .text(evil, evil)
        .fact(evil, evil)
        .html();
    assert_well_formed(&page);
    assert!(!page.contains("<img") && !page.contains("<!--"));
    // The scripts of the report and one of data for each recording; no more.
    assert_eq!(page.matches("<script").count(), 3);
    assert!(!error_falling(&steps, c.noise_floor).contains("<img"));
}

#[test]
fn what_does_not_apply_is_a_dash_and_never_nan() {
    let m = model(Motion::Linear);
    let mut c = empty();
    c.per_recording.push(recording("servo.mat", servo_traces()));
    c.per_recording[0].esr = PerSignal { torque: Some(0.03), ..PerSignal::default() };
    c.per_recording[0].rms = PerSignal { torque: Some(8.5), ..PerSignal::default() };
    c.per_recording[0].noise_floor = PerSignal { torque: Some(f64::NAN), ..PerSignal::default() };
    c.per_recording[0].structured = PerSignal::default();
    c.esr = c.per_recording[0].esr;
    c.per_recording.push(recording("empty.csv", Default::default()));
    let full = comparison(vec![]);
    let page = Report::new("Linear drive").comparison("Servo", &c, &m).comparison("All empty", &empty(), &m).html();
    assert_well_formed(&page);
    for not in ["NaN", "inf ", "Infinity", "null %"] {
        assert!(!markup_only(&page).contains(not), "{not} is printed");
    }
    assert!(page.contains("Force error to signal") && page.contains("3.00 %") && page.contains("Noise floor –"));
    assert!(page.contains("RMS, N<") && !page.contains("RMS, N m<"));
    assert!(page.contains("no signals were kept for plots"));
    assert!(page.contains(">kg<") && page.contains("N s²/m²") && page.contains("moving mass"));
    assert!(page.contains("no region stands out"));
    let linear = Report::new("x").comparison("y", &full, &m).html();
    assert!(linear.contains("Speed v, m/s") && !markup_only(&linear).contains("rad/s\""));
}

#[test]
fn a_minute_of_three_channels_fits_whole_in_five_megabytes() {
    let c = comparison(vec![recording("minute.csv", traces(60.0))]);
    let page = Report::new("x").comparison("c", &c, &model(Motion::Rotary)).html();
    println!("60 s at 10 kHz: {} bytes", page.len());
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
    let blocks = page.split("\"blocks\":[").nth(1).and_then(|s| s.split(']').next()).expect("blocks");
    assert_eq!(blocks.matches("null").count(), 0, "some samples were left out");
    // Twelve such recordings share the same budget.
    let many: Vec<_> = (0..12).map(|k| recording(&format!("{k}.csv"), traces(20.0))).collect();
    let c = comparison(many);
    let page = Report::new("x").comparison("c", &c, &model(Motion::Rotary)).html();
    println!("12 × 20 s at 10 kHz: {} bytes", page.len());
    assert!(page.len() < SIGNAL_BUDGET + 600_000, "{} bytes", page.len());
}

#[test]
fn the_figure_stands_alone() {
    let at = |current, speed| PerSignal { current, speed, torque: None };
    let steps = [
        Step { label: "base model".into(), esr: at(Some(0.2), Some(0.05)) },
        Step { label: "+ saturation".into(), esr: at(Some(0.05), None) },
    ];
    let svg = error_falling(&steps, at(Some(0.01), Some(f64::NAN)));
    assert_well_formed(&svg);
    assert!(svg.starts_with("<svg") && svg.contains("xmlns=\"http://www.w3.org/2000/svg\""));
    // Bars are to scale: the longest is 230 units, and a quarter of it is 57.5.
    assert!(svg.contains("width=\"230.0\"") && svg.contains("width=\"57.5\""), "{svg}");
    assert!(svg.contains("20.0 %") && svg.contains("5.00 %") && svg.contains('–') && !svg.contains("NaN"));
    assert!(error_falling(&[], PerSignal::default()).ends_with("</svg>"));
}

proptest! {
    /// Buckets are what a reader sees: their smallest and largest samples must all be there.
    #[test]
    fn extremes_survive_reduction(
        signal in proptest::collection::vec(prop_oneof![9 => -1e3..1e3f64, 1 => Just(f64::NAN)], 1..3000),
        points in 2usize..500,
        window in any::<(prop::sample::Index, prop::sample::Index)>(),
    ) {
        let reduced = extremes(&signal, points);
        prop_assert!(reduced.points.len() <= points.max(2));
        let width = (2.0 * reduced.step) as usize;
        let range = |values: &mut dyn Iterator<Item = f32>| {
            values.filter(|v| v.is_finite()).fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
        };
        // A window of whole buckets (any window, where nothing was left out).
        let (samples_each, points_each) = if reduced.step == 1.0 && reduced.points.len() == signal.len() { (1, 1) } else { (width, 2) };
        let buckets = signal.len().div_ceil(samples_each);
        let (a, b) = (window.0.index(buckets), window.1.index(buckets));
        let (a, b) = (a.min(b), a.max(b) + 1);
        let whole = range(&mut signal[a * samples_each..(b * samples_each).min(signal.len())].iter().map(|&v| v as f32));
        let kept = range(&mut reduced.points[a * points_each..b * points_each].iter().copied());
        prop_assert_eq!(whole, kept);
    }

    /// No figures, however wild, break the page.
    #[test]
    fn any_figures_make_a_page(value in prop::num::f64::ANY, edge in prop::num::f64::ANY, count in any::<usize>()) {
        let mut c = comparison(vec![]);
        c.esr.current = Some(value);
        c.regions[0].share = value;
        c.regions[0].to = edge;
        c.profiles[0].mean[2] = value;
        c.profiles[0].edges[3] = edge;
        c.profiles[1].counts[0] = count / 64;
        c.maps[0].mean[30] = value;
        c.maps[0].speed_edges[20] = edge;
        let mut m = model(Motion::Rotary);
        if let Some(r) = m.parameters.get_mut("R") {
            r.value = value;
            r.ci95 = Some([edge, value]);
        }
        let page = Report::new("x").comparison("c", &c, &m).html();
        assert_well_formed(&page);
        prop_assert!(!markup_only(&page).contains("NaN"));
    }
}
