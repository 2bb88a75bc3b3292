//! The page itself: what it holds before anything is known; its script fills it from the state.

use maud::{DOCTYPE, html};

/// Its script.
pub const SCRIPT: &str = include_str!("../../assets/serve.js");
/// Its style: that of reports, and a little more.
pub const STYLE: &str = concat!(include_str!("../../assets/report.css"), include_str!("../../assets/serve.css"));

/// The page.
pub fn page() -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "greyrig" }
                link rel="icon" href="data:,";
                link rel="stylesheet" href="serve.css";
                script src="serve.js" defer {}
            }
            body {
                header {
                    h1 { "greyrig" }
                    p.lead { "Compare a motor's model with its measurements, see where it fails, add the effect that is missing, and watch the \
                        error fall." }
                    noscript { p.note { "This page needs scripts; " code { "greyrig diagnose" } " and its like do the same in a terminal." } }
                }
                p #error .note role="alert" hidden {}
                main {
                    section aria-labelledby="recordings-title" {
                        h2 #recordings-title { "Recordings" }
                        ul #recordings {}
                        p { label.button { "Add recordings, or drop them anywhere: " input #files type="file" multiple; } }
                        p.key { "CSV, Parquet, MF4, MAT, HDF5, TDMS, NumPy or WAV; all of one motor type. With several the last one judges what is added; of a single one its last third." }
                    }
                    section aria-labelledby="model-title" {
                        h2 #model-title { "Model" }
                        p.actions {
                            button #identify { "Identify the base model" } " "
                            button #diagnose { "What is missing?" } " "
                            button #undo { "Undo" } " "
                            button #redo { "Redo" } " "
                            a #model download="model.toml" href="model.toml" hidden { "Download model.toml" }
                        }
                        p.actions { span #job role="status" {} button #stop hidden { "Stop" } }
                        div.scroll { table #versions hidden {
                            caption { "Versions of the model: error-to-signal ratio in free run on data held out, its noise floor, and on training data" }
                            thead { tr {
                                th scope="col" { "Version" } th.number scope="col" { "Current" } th.number scope="col" { "floor" } th.number scope="col" { "training" }
                                th.number scope="col" { "Speed" } th.number scope="col" { "floor" } th.number scope="col" { "training" }
                                th scope="col" { "Judgement" } th scope="col" {}
                            } }
                            tbody {}
                        } }
                        figure #falling hidden { div.scroll { img alt="The error falling from version to version"; } }
                        div.scroll { table #parameters hidden {
                            caption { "Parameters of the present version" }
                            thead { tr { th scope="col" { "Parameter" } th.number scope="col" { "Value" } th.number scope="col" { "95 % interval" } th scope="col" { "Unit" } } }
                            tbody {}
                        } }
                        ul #notes {}
                    }
                    section #verdict hidden aria-labelledby="verdict-title" {
                        h2 #verdict-title {}
                        p #odds .note hidden {}
                        p.actions #add {}
                        p #next .note hidden {}
                        div #why {}
                        div.scroll { table #candidates {
                            caption { "Candidates step by step, best first" }
                            thead { tr {
                                th.number scope="col" { "Step" } th scope="col" { "Candidate" } th.number scope="col" { "Held-out error falls by" }
                                th.number scope="col" { "Current with it" } th.number scope="col" { "Speed" } th scope="col" { "Objection" } th scope="col" {}
                            } }
                            tbody {}
                        } }
                    }
                    section #comparison hidden aria-labelledby="comparison-title" {
                        h2 #comparison-title { "Where the model fails" }
                        iframe title="Report: model against measurement" {}
                    }
                }
                footer { p { "greyrig " (env!("CARGO_PKG_VERSION")) ", on this machine alone." } }
            }
        }
    }
    .into_string()
}
