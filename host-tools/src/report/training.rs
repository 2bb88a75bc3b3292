//! What a training did, as a report.

use super::{Curves, Report, Surface, Table};
use crate::anfis::csv::Named;
use crate::anfis::{Stopped, Trained};
use crate::network::Net;

/// Points of a membership function's curve.
const POINTS: usize = 200;
/// Cells of a response surface along each axis.
const CELLS: usize = 40;
/// Response surfaces at most.
const SURFACES: usize = 6;

/// The report of a training on a table.
pub fn report(data: &Named, trained: &Trained, command: &str) -> Report<'static> {
    let net = &trained.net;
    let checking = trained.rmse_chk.map_or(String::new(), |e| format!(", {e:.4e} on the checking data"));
    let mut report = Report::new(format!("ANFIS of {} over {}", data.target, data.inputs.join(", ")))
        .lead(format!(
            "{} inputs with {} membership functions each: {} rules. RMS error {:.4e} on the training data{checking}.",
            net.inputs,
            net.functions,
            net.rules(),
            trained.rmse_trn
        ))
        .lead(why(trained.stopped))
        .fact("Command", command)
        .fact("Rows", data.table.rows().to_string())
        .fact("Ridge λ", format!("{:.3e}", trained.ridge))
        .curves("Learning", learning(trained));
    report = network(report, &data.inputs, &data.target, trained);
    report.table("Rules", rules(&data.inputs, trained))
}

/// Adds what the network has learnt: its membership functions before and after, and its response.
pub fn network<'a>(mut report: Report<'a>, inputs: &[String], target: &str, trained: &Trained) -> Report<'a> {
    for (name, both) in inputs.iter().zip(memberships(inputs, trained)) {
        for (when, curves) in ["before", "after"].into_iter().zip(both) {
            report = report.curves(format!("Membership functions of {name}, {when} training"), curves);
        }
    }
    if trained.net.inputs == 1 {
        report = report.curves("Response", response(trained, &inputs[0], target));
    }
    for surface in surfaces(inputs, target, trained) {
        report = report.surface(format!("Response over {} and {}", surface.x.0, surface.y.0), surface);
    }
    report
}

/// The membership functions of each input, before and after the training.
pub fn memberships(inputs: &[String], trained: &Trained) -> Vec<[Curves; 2]> {
    let of = |i: usize| [&trained.initial, &trained.net].map(|net| functions(net, i, &inputs[i], trained.inputs[i]));
    (0..inputs.len()).map(of).collect()
}

/// The response over each pair of inputs, of six pairs at most.
pub fn surfaces(inputs: &[String], target: &str, trained: &Trained) -> Vec<Surface> {
    let count = trained.net.inputs;
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b)));
    pairs.take(SURFACES).map(|(a, b)| surface(inputs, target, trained, a, b)).collect()
}

fn why(stopped: Stopped) -> &'static str {
    match stopped {
        Stopped::Epochs => "Training did all epochs that were asked for.",
        Stopped::Converged => "Training ended where the error falls no more.",
        Stopped::Check => {
            "Training ended where the checking error falls no more; the network with the smallest one is kept."
        }
        Stopped::Diverged => "Training ended where the error was no number any more; an earlier network is kept.",
        Stopped::Asked => "Training was stopped.",
    }
}

fn learning(trained: &Trained) -> Curves {
    let epochs = || (1..).map(f64::from).zip(&trained.epochs);
    let mut curves = vec![("training".to_owned(), epochs().map(|(k, e)| (k, e.rmse_trn)).collect())];
    if trained.epochs.iter().any(|e| e.rmse_chk.is_some()) {
        let checking = epochs().filter_map(|(k, e)| e.rmse_chk.map(|c| (k, c))).collect();
        curves.push(("checking".to_owned(), checking));
    }
    Curves {
        caption: format!("RMS error by epoch; epoch {} is kept", trained.best + 1),
        x: "Epoch".into(),
        y: "RMS error".into(),
        logarithmic: true,
        curves,
    }
}

/// Values from one end of a range to the other.
fn along((low, high): (f64, f64), points: usize) -> impl Iterator<Item = f64> {
    (0..=points).map(move |k| low + (high - low) * k as f64 / points as f64)
}

fn functions(net: &Net, input: usize, name: &str, range: (f64, f64)) -> Curves {
    let curve = |j: usize| along(range, POINTS).map(|x| (x, net.membership(input, j, x))).collect();
    Curves {
        caption: format!("Membership over the range of {name} in the data"),
        x: name.to_owned(),
        y: "Membership μ".into(),
        logarithmic: false,
        curves: (0..net.functions).map(|j| (format!("function {}", j + 1), curve(j))).collect(),
    }
}

fn response(trained: &Trained, name: &str, target: &str) -> Curves {
    let of = |net: &Net| along(trained.inputs[0], POINTS).map(|x| (x, net.output(&[x]))).collect();
    Curves {
        caption: "Output of the network".into(),
        x: name.to_owned(),
        y: target.to_owned(),
        logarithmic: false,
        curves: vec![("before training".into(), of(&trained.initial)), ("after".into(), of(&trained.net))],
    }
}

fn surface(inputs: &[String], target: &str, trained: &Trained, a: usize, b: usize) -> Surface {
    let mut x: Vec<f64> = trained.inputs.iter().map(|(low, high)| 0.5 * (low + high)).collect();
    let others = if x.len() > 2 { ", the other inputs in the middle of their ranges" } else { "" };
    let middle = |(low, high): (f64, f64), k: usize| low + (high - low) * (k as f64 + 0.5) / CELLS as f64;
    let mut values = Vec::with_capacity(CELLS * CELLS);
    for row in 0..CELLS {
        for column in 0..CELLS {
            x[a] = middle(trained.inputs[a], column);
            x[b] = middle(trained.inputs[b], row);
            // As it is evaluated: within the range of the training targets.
            values.push(trained.net.output(&x).clamp(trained.output.0, trained.output.1));
        }
    }
    let axis = |i: usize| (inputs[i].clone(), trained.inputs[i].0, trained.inputs[i].1);
    Surface {
        caption: format!("Output over the trained box{others}"),
        x: axis(a),
        y: axis(b),
        value: target.to_owned(),
        columns: CELLS,
        values,
    }
}

fn rules(inputs: &[String], trained: &Trained) -> Table {
    let net = &trained.net;
    let mut columns: Vec<String> = vec!["Functions".into(), "Rows it stands for".into(), "Largest share".into()];
    columns.extend(inputs.iter().map(|name| format!("Slope by {name}")));
    columns.push("Constant".into());
    let rows = (0..net.rules()).map(|rule| {
        let support = &trained.support[rule];
        let functions = (0..net.inputs).map(|i| (net.function_of(rule, i) + 1).to_string());
        let mut row = vec![functions.collect::<Vec<_>>().join("·")];
        row.push(format!("{:.1}", support.rows));
        row.push(format!("{:.1} %", 100.0 * support.largest));
        let consequents = &net.consequents[rule * (net.inputs + 1)..][..=net.inputs];
        let printed = |c: &f64| if support.pruned { "dropped".into() } else { format!("{c:.4e}") };
        row.extend(consequents.iter().map(printed));
        row
    });
    Table {
        caption: "Each rule by its inputs' membership functions, with its support in the training data".into(),
        columns,
        rows: rows.collect(),
    }
}
