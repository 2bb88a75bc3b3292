//! What the firmware computes is what the host computes, to the bit.

use greyrig::app::sampler::Sampler;
use greyrig::app::{Shared, Window};
use greyrig::hardware::NUCLEO_G474RE;
use greyrig::link::message::{Report, Request};
use greyrig::parameters::section;
use greyrig::tick::Output;
use greyrig::units::Counts;
use greyrig_board::Board;
use greyrig_board::analog;
use greyrig_board::host::Host;
use greyrig_board::machine::Pace;
use greyrig_board::peripherals::flash::Contents;
use greyrig_host::model::Kind;
use greyrig_host::rig::Setup;

use crate::image;
use crate::station::station;

/// Samples in a report.
const EVERY: u16 = 10;

fn bits(report: &Report) -> [u32; 7] {
    let Report { sample, count, voltage_rms, current_rms, speed, residual_current_rms, residual_speed_rms } = *report;
    let [a, b, c, d, e] = [voltage_rms, current_rms, speed, residual_current_rms, residual_speed_rms].map(f32::to_bits);
    [sample, count.into(), a, b, c, d, e]
}

/// Model, correction, filters and detector run; reports of ten samples each come from both.
#[test]
fn reports_are_equal_in_bits() {
    let run = Setup::new(Kind::Universal).profile("steady").unwrap().seconds(3.0).seed(5).run().unwrap();
    let [u, i, w] = &run.counts;
    let samples: Vec<[u16; 3]> = (0..u.len()).map(|n| [u[n], i[n], w[n]]).collect();

    let mut host = Host::default();
    let source = || Box::new(analog::Counts::new(samples.clone().into_iter()));
    let mut board = Board::new(image(), Contents::default(), source(), Pace::ONE).unwrap();
    let payload = &station().payload;
    host.flash(&mut board, payload).unwrap();
    board.connect(source());
    board.press_reset();
    board.run(0.01).unwrap();
    host.tell(&mut board, Request::StartTelemetry { every: EVERY }).unwrap();
    board.run(2.5).unwrap();
    host.look(&mut board, |_| ());

    let active = section::decode(payload).unwrap().build().unwrap();
    let shared = Shared::new();
    let mut sampler = Sampler::new(Some(active), &shared, &NUCLEO_G474RE);
    let outputs: Vec<Output> = samples
        .iter()
        .map(|&[voltage, current, speed]| sampler.sample(Counts { voltage, current, speed }, 0).unwrap())
        .collect();
    assert!(host.reports.len() > 2_000, "{} reports", host.reports.len());
    for report in &host.reports {
        let mut window = Window::default();
        for number in report.sample + 1 - u32::from(EVERY)..=report.sample {
            window = window.with(number, &outputs[number as usize]);
        }
        assert_eq!(bits(report), bits(&window.report()), "sample {}", report.sample);
    }
    // The motor has run: the comparison is not one of zeros.
    assert!(host.reports.last().unwrap().speed > 1000.0);
}
