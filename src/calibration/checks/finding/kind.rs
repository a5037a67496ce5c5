//! Kinds of findings: their names, their levels and their meanings.

/// Severity of a finding, which determines the verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// The values may not be used.
    Failed,
    /// The values may be used if the finding is taken into account.
    Care,
    /// The result already accounts for it.
    Note,
}

macro_rules! kinds {
    ($($variant:ident = $code:literal $name:literal $level:ident: $explanation:literal)*) => {
        /// Subject of a finding.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Kind {
            $(#[doc = concat!($code, ", `", $name, "`.")] $variant,)*
        }

        impl Kind {
            /// All in the order of their codes.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The code, such as `W07`.
            pub fn code(self) -> &'static str {
                match self { $(Self::$variant => $code,)* }
            }

            /// The name in files, such as `noise-learnt`.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Its severity.
            pub fn level(self) -> Level {
                match self { $(Self::$variant => Level::$level,)* }
            }

            /// Its meaning, cause and remedy.
            pub fn explanation(self) -> &'static str {
                match self { $(Self::$variant => $explanation,)* }
            }
        }
    };
}

kinds! {
    Recording = "W01" "recording" Note:
        "turncal repaired or assumed something when it read the log: gaps that were bridged, rows that were dropped, an \
         uneven clock, a place or a noise figure that run.toml does not state. The σ include what it costs. If the text \
         names a field, state it in run.toml; `turncal check` lists all faults of a log."
    NotConverged = "W02" "not-converged" Failed:
        "The iterations still moved a parameter when they ended, so neither values nor σ are those of the record. The \
         usual causes are a wrong scale, unit, sample period or axis in run.toml, or a record with almost no motion. Run \
         `turncal check` on the run: it compares scale, unit and axes with gravity and the turns."
    Unexplained = "W03" "unexplained" Failed:
        "The residuals are so large that no noise figure explains them, so the values belong to no instrument. The usual \
         causes are labels or table attitudes of another record, axes in another order, a wrong unit, or a slip of the \
         mount. The finding names the interval where the residuals are largest; look there first."
    NotObserved = "W04" "not-observed" Care:
        "The record tells less than half of what was known before about these parameters: their values are mostly those of \
         [imu.prior]. Add positions that put each axis up and down, and a turn of 90° or more about each axis. \
         `turncal check` predicts the σ of each parameter for the record."
    CombinationsNotObserved = "W05" "combinations-not-observed" Care:
        "Each of these parameters alone is determined, but a combination of them is not: their errors compensate in every \
         position of this path. Add positions or turns in which they have different effects. The correlation figure of \
         the report shows which parameters depend on each other."
    HeadingNotObserved = "W06" "heading-not-observed" Note:
        "The gyros do not sense Earth rate well enough to find north. K, E and D do not need the heading; only the Earth \
         rate in the gyro biases is estimated with less accuracy. If you need the heading, use a table, or gyros with a \
         noise below 0.1 °/√h and dwells of a minute."
    NoiseLearnt = "W07" "noise-learnt" Care:
        "The residuals contradict the noise in [imu.noise] by a likelihood-ratio test with a false-alarm rate of 1 in \
         1000. turncal estimated the noise from the record and used it for weights and σ. For a sensor turned by hand \
         this is usual: motion adds noise that a data sheet does not state. To keep the estimate, paste noise.run_toml of \
         calibration.json into [imu.noise]; to use the stated noise anyway, add --noise stated."
    ScatterAtRest = "W08" "scatter-at-rest" Care:
        "In dwells, samples scatter more or less than the stated white noise implies. The figure is measured over 0.1 s, so \
         vibration of the mount adds to it. Record an hour at rest and run `turncal allan` to separate noise and \
         vibration, then state the result in [imu.noise]."
    BiasesMayVary = "W09" "biases-may-vary" Note:
        "A short record cannot show how the biases wander. turncal assumed the variation that is usual for this class of \
         sensor and widened σ by it. Record several hours at rest, run `turncal allan`, and state the bias instability \
         and its correlation time in [imu.noise]."
    Inconsistent = "W10" "inconsistent" Care:
        "The normalised innovation squared (NIS) is outside its 99.9 % interval: the residuals are larger or smaller than \
         noise and model predict. Larger only after moves: table position, a scale factor or a time offset. Larger in \
         dwells: bias drift, often by temperature (--temperature). Everywhere: the white noise in [imu.noise]."
    ErrorTermSignificant = "W11" "error-term-significant" Care:
        "An error that K, E and D cannot describe is visible, and an error term that is off explains it best. Until the \
         term is estimated, σ are widened by what it may do to the parameters. Rerun with --with and the term."
    ErrorTermEstimated = "W12" "error-term-estimated" Care:
        "The record shows an error term beyond chance, so turncal estimated it together with K, E and D. The values are \
         right only together with this term: `turncal apply` removes it, while export formats without terms leave it in \
         and say so. To leave it out, list the terms you want: --with none."
    DwellsScatter = "W13" "dwells-scatter" Care:
        "The dwells disagree with each other more than their σ allow, which no estimated noise or term explains. turncal \
         widened σ by the observed scatter. Look at the effects of error terms in the report; one of them may explain it."
    Outliers = "W14" "outliers" Note:
        "Single observations were outside their gate and left out. A few in ten thousand are chance; several in one dwell \
         point to a bump or to motion in the dwell. Look at the residuals of that dwell in the report."
    Settling = "W15" "settling" Note:
        "After each stop the attitude or the sensors need some time to settle. turncal leaves that time out of every \
         dwell. Wait longer after each stop, or stiffen the mount, if dwells become too short."
    PositionWrong = "W16" "position-wrong" Care:
        "The table's attitude in one dwell contradicts gyros and accelerometers. turncal left out its readings there and \
         used the rest. Look in the table's log for a missed step, a wrong label or a bump at that time."
    MoveWrong = "W17" "move-wrong" Care:
        "In one move the gyros integrate to another angle than the attitudes before and after it show. turncal estimated \
         the difference. Look there for lost samples, a rate beyond the range of the gyros, or a mount that slipped."
    BiasStep = "W18" "bias-step" Care:
        "A bias changed between two dwells and stayed changed. turncal estimated the step; the calibration holds the mean \
         of the bias before and after it. Look there for a shock or a change of supply or temperature, and repeat the \
         record if the bias matters."
    EarthRateWrong = "W19" "earth-rate-wrong" Care:
        "The gyros sense another Earth rate than the one at the stated latitude, through all attitudes. turncal estimated \
         the difference. Check latitude_deg (its sign first), and north and level of the table."
    FarFromPrior = "W20" "far-from-prior" Care:
        "Parameters are many σ of [imu.prior] away from the prior. Either run.toml states a wrong unit, scale, sign or axis \
         order, or the prior σ are too small for this instrument. The finding lists likely causes."
    FormRejected = "W21" "form-rejected" Care:
        "The chosen installation form has fewer angles than the record shows. Values in this form are wrong by more than \
         their σ. Rerun with --installation general."
    Rounded = "W22" "rounded" Care:
        "The log rounds values more coarsely than their noise, so averaging cannot recover the mean within a step. σ \
         include it. Log more digits, or raw counts."
    ChangesInTime = "W23" "changes-in-time" Care:
        "The residuals show a parameter that drifts during the record. The calibration holds its mean. Let the instrument \
         warm up, keep its temperature constant, or use --temperature if the log has a temperature column."
    EvenTermsInseparable = "W24" "even-terms-inseparable" Care:
        "With an axis up or down, an accelerometer's second-order term and its asymmetry have the same effect. Add dwells with \
         axes at about 45°, or leave one of the two terms off."
    TemperatureNotSeen = "W25" "temperature-not-seen" Care:
        "The record does not show how these parameters change with temperature, so they are valid only at the recorded \
         temperatures. Record positions and turns at several temperatures."
    RecordingsDiffer = "W26" "recordings-differ" Care:
        "Recordings of one instrument differ more than their σ and [day_to_day] allow. turncal estimated the difference and \
         included it in σ. Usual causes are the change of bias at switch-on, remounting, and a temperature sensor away \
         from the inertial sensors."
    LabelsContradicted = "W27" "labels-contradicted" Care:
        "Labels of sections contradict gravity or the gyros. The finding says which, and whether the section was used. \
         Correct the label in the file of [segments]."
    SectionsLost = "W28" "sections-lost" Care:
        "A labelled section was skipped: too many rows are missing. Record it again, or remove it from [segments]."
    ResidualsLarge = "W29" "residuals-large" Care:
        "The closed form leaves larger residuals than stated noise and table errors explain. turncal widened σ by as much. \
         The finding names the interval with the largest residual: look there for a bump, a wrong label or attitude; else \
         check the noise figures, and level and north of the table."
    StatementDoubted = "W30" "statement-doubted" Care:
        "A statement of run.toml hardly fits the log: gravity far from normal gravity at the place, a column that never \
         changes or is there twice, a table log of another time or clock. Each of them changes the result by more than its \
         σ. Correct the field or the log that the finding names."
    PriorContradicted = "W31" "prior-contradicted" Failed:
        "A scale factor is so far from the stated one that no careless prior explains it: by more than 10 σ of the prior and \
         more than 10 %, or by more than 41 %. The estimate may be of another turn or another unit. Correct scale, unit or \
         sample_period_s in [imu], or widen scale_sigma_ppm if the sensor really is so far off."
}

impl Kind {
    /// The kind with this name or code.
    pub fn named(text: &str) -> Option<Self> {
        let is_named = |of: &&Self| of.name() == text || of.code().eq_ignore_ascii_case(text);
        Self::ALL.iter().find(is_named).copied()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn codes_are_numbered_through_and_names_are_distinct() {
        for (number, kind) in (1..).zip(Kind::ALL) {
            assert_eq!(kind.code(), format!("W{number:02}"));
            assert_eq!(Kind::named(kind.name()), Some(*kind));
            assert_eq!(Kind::named(&kind.code().to_lowercase()), Some(*kind));
        }
        let names: BTreeSet<&str> = Kind::ALL.iter().map(|kind| kind.name()).collect();
        assert_eq!(names.len(), Kind::ALL.len());
        assert_eq!(Kind::named("nothing"), None);
    }
}
