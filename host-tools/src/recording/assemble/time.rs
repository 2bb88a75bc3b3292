//! When the samples were taken.

use std::collections::BTreeMap;

use super::{Assembly, Use};
use crate::error::Result;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::recording::mapping::Mapping;
use crate::recording::names::Role;
use crate::recording::stamps::{self, Placement, Taken};
use crate::recording::time_axis::{self, TimeAxis, short};
use crate::recording::{Channel, gaps};

/// Scatter of stamps from which it is said that they are not followed, as a share of the interval.
const JITTER_TOLD: f64 = 0.05;

impl Assembly<'_> {
    pub(super) fn time(
        &mut self,
        raster: usize,
        rows: usize,
        uses: &BTreeMap<Role, Use>,
        usable: &[bool],
        mapping: &Mapping,
    ) -> Result<Placement> {
        let told = |start_s, interval_s| Placement::uniform(TimeAxis { start_s, interval_s, jitter: 0.0 }, rows);
        if let Some(interval_s) = mapping.sample_time_s {
            return Ok(told(0.0, interval_s));
        }
        let stated = time_axis::from_metadata(&self.table).map_err(|(what, remedy)| self.whole(what, remedy))?;
        if let Some(found) = uses.get(&Role::Time) {
            let every_row = vec![true; rows];
            let (t, _) = self.si(Role::Time, found, 1.0, &every_row, false)?;
            let mut placement = stamps::read(&without_fill(t, usable))
                .map_err(|f| self.at(f.row, Some(found.source.column), &f.what, f.remedy.clone()))?;
            let is_on_rows = placement.is_on_rows();
            let axis = &mut placement.axis;
            if let Some(interval) = stated {
                // Stamps are rounded, the statement is not: take it where both agree.
                let off = (axis.interval_s / interval - 1.0).abs() * (placement.rows - 1) as f64;
                if off < 0.5 {
                    // What is interpolated is so to the rows of the stamps.
                    axis.interval_s = if is_on_rows { interval } else { axis.interval_s };
                } else {
                    self.warnings.push(format!(
                        "the metadata state a sampling interval of {} s, the time column {} s; the time column is used",
                        short(interval),
                        short(axis.interval_s)
                    ));
                }
            }
            self.tell_time(&placement);
            return Ok(placement);
        }
        let own =
            self.table.columns.iter().filter(|c| c.raster == raster).find_map(|c| Some((c.interval_s?, c.start_s)));
        if let Some((interval_s, start_s)) = own {
            return Ok(told(start_s, interval_s));
        }
        if rows < 2 {
            return Err(self.whole("there is only one sample", "record at least two samples"));
        }
        match stated {
            Some(interval_s) => Ok(told(0.0, interval_s)),
            None => Err(self.whole(
                format!("there is no time column among {}", self.column_list()),
                "add a column t_s, or give the interval with --map sample_time_s=1e-4 (in CSV also '# sample_time_s: 1e-4' before the header)",
            )),
        }
    }
}

impl Assembly<'_> {
    fn finding(&self, code: Code, severity: Severity, text: String) -> DataFinding {
        DataFinding::new(code, severity, self.path, text)
    }

    /// Leaves out rows that stand twice.
    pub(super) fn leave_out_doubled(&mut self, raster: usize, uses: &BTreeMap<Role, Use>) {
        let Some(found) = uses.get(&Role::Time).filter(|found| found.source.expression.is_none()) else { return };
        let Some(doubled) = stamps::leave_out_doubled(&mut self.table, raster, found.source.column) else { return };
        let (rows, stand) = if doubled.rows == 1 { ("row", "stands") } else { ("rows", "stand") };
        let text = format!(
            "{} {rows} with the stamp and the values of the row before {stand} twice, the first one as row {}",
            doubled.rows,
            doubled.first + 1
        );
        let finding = self.finding(Code::TimeJitter, Severity::Info, text).value(doubled.rows as f64, "rows");
        self.findings.push(finding.handled(Handled::Corrected));
    }

    /// What the stamps alone tell: gaps, and too few digits.
    fn tell_time(&mut self, placement: &Placement) {
        let TimeAxis { start_s, interval_s, .. } = placement.axis;
        for gap in &placement.gaps {
            let [before, after] = [gap.start - 1, gap.end].map(|row| start_s + row as f64 * interval_s);
            let (samples, are) = if gap.len() == 1 { ("sample", "is") } else { ("samples", "are") };
            let text = format!(
                "{} {samples} between {} s and {} s {are} missing: what comes before and after is taken apart",
                gap.len(),
                short(before),
                short(after)
            );
            let finding = self.finding(Code::TimeGap, Severity::Warning, text).between(before, after);
            self.findings.push(finding.value(gap.len() as f64 * interval_s, "s").handled(Handled::Split));
        }
        if let Some(resolution_s) = placement.coarse_s {
            let text = format!(
                "several samples share a stamp, which tells {} s: each fits a uniform interval of {} s, which is taken",
                short(resolution_s),
                short(interval_s)
            );
            // Rounding is uniform within its width.
            let rms = resolution_s / 12f64.sqrt();
            let finding = self.finding(Code::TimeJitter, Severity::Info, text).value(rms, "s");
            self.findings.push(finding.handled(Handled::Corrected));
        } else if placement.axis.jitter > JITTER_TOLD && placement.is_on_rows() {
            self.tell_uniform(placement);
        }
    }

    fn tell_uniform(&mut self, placement: &Placement) {
        self.warnings.push(format!(
            "the time stamps jitter by up to {:.0} % of the sampling interval; uniform sampling is assumed",
            100.0 * placement.axis.jitter
        ));
    }

    /// Channels on the rows of the raster: as they are, or interpolated where they were taken beside them.
    pub(super) fn at_rows(&mut self, placement: &Placement, channels: &mut BTreeMap<Channel, Vec<f64>>) {
        if placement.is_on_rows() {
            for values in channels.values_mut() {
                *values = placement.gather(std::mem::take(values), f64::NAN);
            }
            return;
        }
        let taken = stamps::judge(placement, channels.values().map(Vec::as_slice));
        let scatter_s = placement.scatter_s();
        let follows = taken == Taken::AsStamped;
        let mut largest = 0.0f64;
        for values in channels.values_mut() {
            if follows || placement.wanders() {
                let (on_rows, error) = stamps::at_rows(placement, values, follows || scatter_s.is_none());
                (*values, largest) = (on_rows, largest.max(error));
            } else {
                *values = placement.gather(std::mem::take(values), f64::NAN);
            }
        }
        let interpolated = format!("interpolated to a uniform interval, usually to {:.2} % or better", 100.0 * largest);
        if placement.wanders() {
            let strays_s = placement.strays_s();
            let text = format!(
                "the sampling rate wanders, by {} s in the run; the samples are {interpolated}",
                short(strays_s)
            );
            let finding = self.finding(Code::TimeJitter, Severity::Info, text).value(strays_s, "s");
            self.findings.push(finding.handled(Handled::Corrected));
        }
        let Some(scatter_s) = scatter_s else { return };
        let scatter = format!(
            "the time stamps scatter by {} s ({:.0} % of the interval)",
            short(scatter_s),
            100.0 * scatter_s / placement.axis.interval_s
        );
        let (text, handled) = match taken {
            Taken::AsStamped => {
                (format!("{scatter}, and the samples were taken then; they are {interpolated}"), Handled::Corrected)
            }
            Taken::Uniformly => (
                format!("{scatter}, and the samples were not taken then, but uniformly: the stamps are not followed"),
                Handled::None,
            ),
            Taken::Untold => (
                format!(
                    "{scatter}; the samples do not tell whether they were taken then, and uniform ones are assumed"
                ),
                Handled::None,
            ),
        };
        if handled == Handled::None && placement.axis.jitter > JITTER_TOLD {
            self.tell_uniform(placement);
        }
        let finding = self.finding(Code::TimeJitter, Severity::Info, text).value(scatter_s, "s").handled(handled);
        self.findings.push(finding);
    }
}

/// Stamps in which those of unusable rows lie on the line between their neighbours, where it is they that break the
/// order.
fn without_fill(t: Vec<f64>, usable: &[bool]) -> Vec<f64> {
    let ordered = |t: &[f64]| t.windows(2).all(|w| w[1] > w[0]);
    if ordered(&t) || usable.iter().all(|usable| *usable) {
        return t;
    }
    let known: Vec<(usize, f64)> = t.iter().copied().enumerate().filter(|(k, _)| usable[*k]).collect();
    let [(first, start), .., (last, end)] = known.as_slice() else { return t };
    let interval = (end - start) / (last - first) as f64;
    let mut filled: Vec<f64> = t.iter().zip(usable).map(|(t, usable)| if *usable { *t } else { f64::NAN }).collect();
    gaps::bridge(&mut filled);
    for (k, t) in filled.iter_mut().enumerate() {
        if k < *first {
            *t = start - (first - k) as f64 * interval;
        } else if k > *last {
            *t = end + (k - last) as f64 * interval;
        }
    }
    filled
}
