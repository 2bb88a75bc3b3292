//! The anchor of a heading, as mdBook and the usual forges name it.

use std::collections::HashMap;

/// Anchors of the headings of a page, in order.
#[derive(Debug, Default)]
pub struct Slugs(HashMap<String, usize>);

impl Slugs {
    /// The anchor of the next heading: lower case, blanks as hyphens, no other sign than `_` and `-`; the second one of
    /// the same text gets a `-1`.
    pub fn next(&mut self, heading: &str) -> String {
        let slug: String = heading
            .trim()
            .chars()
            .filter_map(|c| match c {
                c if c.is_alphanumeric() || c == '_' || c == '-' => Some(c),
                c if c.is_whitespace() => Some('-'),
                _ => None,
            })
            .flat_map(char::to_lowercase)
            .collect();
        let count = self.0.entry(slug.clone()).or_default();
        *count += 1;
        if *count == 1 { slug } else { format!("{slug}-{}", *count - 1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_are_named_as_forges_name_them() {
        let mut slugs = Slugs::default();
        assert_eq!(slugs.next("Which effect is missing?"), "which-effect-is-missing");
        assert_eq!(slugs.next("`[fitted]` in the model file"), "fitted-in-the-model-file");
        assert_eq!(slugs.next("Tables that grow: `a --b`"), "tables-that-grow-a---b");
        assert_eq!(slugs.next("Größe"), "größe");
        assert_eq!(slugs.next("torque_ripple"), "torque_ripple");
        assert_eq!((slugs.next("Limits"), slugs.next("Limits")), ("limits".to_owned(), "limits-1".to_owned()));
    }
}
