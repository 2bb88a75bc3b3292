//! The page itself: its script fills it from the state. Both are made from `host-tools/web`.

use maud::{DOCTYPE, html};

/// Its script.
pub const SCRIPT: &str = include_str!("../../assets/serve.js");
/// Its style.
pub const STYLE: &str = include_str!("../../assets/serve.css");

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
                div #page data-version=(env!("CARGO_PKG_VERSION")) {
                    noscript { p { "This page needs scripts; " code { "greyrig diagnose" } " and its like do the same in a terminal." } }
                }
            }
        }
    }
    .into_string()
}
