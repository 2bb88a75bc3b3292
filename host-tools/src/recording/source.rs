//! Where a channel came from, and the `--map` that would take it otherwise.

/// A column of a file, and what was done to its numbers.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SourceColumn {
    /// Its name in the file.
    pub name: String,
    /// Factor on the number in the file.
    pub gain: f64,
    /// Added after the gain.
    pub offset: f64,
    /// Unit that was given for the result; none: the column's own, or SI.
    pub unit: Option<String>,
}

impl SourceColumn {
    /// A column that was taken as it is.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), gain: 1.0, offset: 0.0, unit: None }
    }

    /// The same, times a factor.
    #[must_use]
    pub fn times(mut self, factor: f64) -> Self {
        self.gain *= factor;
        self.offset *= factor;
        self
    }

    /// The same in another unit.
    #[must_use]
    pub fn in_unit(mut self, unit: &str) -> Self {
        self.unit = Some(unit.to_owned());
        self
    }

    /// The option that takes a channel so, quoted for the shell where it has to be.
    ///
    /// ```
    /// use greyrig_host::recording::SourceColumn;
    ///
    /// assert_eq!(SourceColumn::new("w").times(-1.0).map("omega_rad_s"), "--map omega_rad_s=w*-1");
    /// assert_eq!(SourceColumn::new("n").in_unit("rpm").map("omega_rad_s"), "--map 'omega_rad_s=n[rpm]'");
    /// ```
    pub fn map(&self, target: &str) -> String {
        let mut text = self.name.clone();
        if self.gain != 1.0 {
            text += &format!("*{}", self.gain);
        }
        if self.offset != 0.0 {
            text += &format!("{:+}", self.offset);
        }
        if let Some(unit) = &self.unit {
            text += &format!("[{unit}]");
        }
        let plain = text.chars().all(|c| c.is_alphanumeric() || "_-./*+".contains(c));
        // An asterisk in a word with an equals sign matches no file.
        if plain { format!("--map {target}={text}") } else { format!("--map '{target}={text}'") }
    }
}
