//! A prediction as columns of a file: those of a recording, so that whatever reads one reads the other.

use std::ops::Range;

use super::{Band, Prediction};
use crate::model::Model;
use crate::recording::series::Series;
use crate::recording::{Channel, Motion, Recording, recorded, say_metadata, state_channels};
use crate::speed_sensor;

/// Put before the name of what was measured, and before what the metadata say of it alone.
pub const MEASURED: &str = "measured_";

/// Metadata that are of the measured channels and not of the predicted ones.
const OF_MEASURED: [&str; 2] = ["skew_i_a_s", "skew_omega_rad_s_s"];

impl Prediction {
    /// The columns of a file: `t_s`, `u_v`, predicted `i_a` and `omega_rad_s`, their bands, where they are
    /// extrapolated, and all else that the recording holds; what was measured as `measured_i_a` and the like. Rows of a
    /// gap are left out.
    pub fn series(&self, model: &Model, recording: &Recording) -> Series {
        let mut series = Series::default();
        let [ampere, of_speed] = [Channel::Current, Channel::Speed].map(|channel| channel.unit(model.motion));
        series.numbers("t_s", (0..self.current.len()).map(|n| self.time_s(n)).collect(), Some("s"));
        if let Some(voltage) = recording.measured(Channel::Voltage) {
            series.numbers(Channel::Voltage.column(), voltage, Some(Channel::Voltage.unit(model.motion)));
        }
        series.numbers(Channel::Current.column(), self.current.clone(), Some(ampere));
        series.numbers(Channel::Speed.column(), self.speed.clone(), Some(of_speed));
        if let Some(Band { current, speed, .. }) = &self.band {
            for (channel, band, unit) in [(Channel::Current, current, ampere), (Channel::Speed, speed, of_speed)] {
                for (side, values) in ["lo", "hi"].into_iter().zip(band.iter().flatten()) {
                    series.numbers(format!("{}_{side}", channel.column()), values.clone(), Some(unit));
                }
            }
        }
        if let Some(extrapolation) = &self.extrapolation {
            series.flags("extrapolated", &extrapolation.samples);
        }
        state_channels(recording, &mut series);
        for channel in Channel::ALL.into_iter().filter(|channel| *channel != Channel::Voltage) {
            if let Some(mut values) = recording.measured(channel) {
                recording.masked(channel).iter().for_each(|k| values[*k] = f64::NAN);
                series.numbers(
                    format!("{MEASURED}{}", channel.column()),
                    values,
                    Some(channel.unit(recording.motion())),
                );
            }
        }
        for extra in recording.extras().iter().filter(|extra| extra.values.len() == self.current.len()) {
            series.numbers(&extra.name, extra.values.clone(), None);
        }
        if !self.gaps.is_empty() {
            series.retain(&recorded(recording));
        }
        self.say(&mut series, model, recording);
        series
    }

    /// Number of samples without those of gaps.
    pub fn recorded(&self) -> usize {
        self.current.len() - self.gaps.iter().map(Range::len).sum::<usize>()
    }

    /// The last sample that is not of a gap.
    pub fn last(&self) -> Option<usize> {
        self.current.iter().rposition(|i| !i.is_nan())
    }

    /// Time of a sample, s.
    pub fn time_s(&self, n: usize) -> f64 {
        self.start_s + n as f64 * self.interval_s
    }

    fn say(&self, series: &mut Series, model: &Model, recording: &Recording) {
        say_metadata(recording, series);
        let no_sensor = self.speed_sensor.is_none().then_some(speed_sensor::KEY);
        for key in OF_MEASURED.into_iter().chain(no_sensor) {
            if let Some(value) = series.unsay(key) {
                series.say(format!("{MEASURED}{key}"), value);
            }
        }
        if let Some(sensor) = self.speed_sensor {
            series.say(speed_sensor::KEY, sensor.to_string());
        }
        if let Some(motor) = &model.motor {
            series.say("motor", motor);
        }
        if model.motion == Motion::Linear {
            series.say("motion", "linear");
        }
        if let Some(band) = &self.band {
            series.say("band", band.share.to_string());
        }
        series.say("predicted", "i_a and omega_rad_s are a model's free run");
    }
}
