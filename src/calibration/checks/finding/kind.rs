//! Kinds of findings: their names, their levels and their meanings.

use serde::{Deserialize, Serialize};

/// Severity of a finding, which determines the verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// The values must not be used.
    Failed,
    /// Some of the requested parameters were not determined.
    Partial,
    /// The values may be used if the finding is taken into account.
    Care,
    /// The result already takes the finding into account.
    Note,
}

macro_rules! kinds {
    ($($variant:ident = $code:literal $name:literal $level:ident: $explanation:literal $remark:literal)*) => {
        /// Subject of a finding.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Kind {
            $(#[doc = concat!($code, ", `", $name, "`.")] $variant,)*
        }

        impl Kind {
            /// All kinds in the order of their codes.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The code, such as `W07`.
            pub fn code(self) -> &'static str {
                match self { $(Self::$variant => $code,)* }
            }

            /// The name in files, such as `noise-learnt`.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Severity.
            pub fn level(self) -> Level {
                match self { $(Self::$variant => Level::$level,)* }
            }

            /// Meaning, cause and remedy.
            pub fn explanation(self) -> &'static str {
                match self { $(Self::$variant => $explanation,)* }
            }

            /// A fact about the results for the customer of a certificate, without advice to the laboratory.
            pub fn remark(self) -> &'static str {
                match self { $(Self::$variant => $remark,)* }
            }
        }
    };
}

kinds! {
    Recording = "W01" "recording" Note:
        "turncal repaired or assumed something when it read the log: for example, it bridged gaps, dropped rows, \
         corrected an uneven clock, or assumed a location or noise figure that run.toml does not state. The σ include \
         the effect. If the finding names a field, set this field in run.toml. `turncal check` lists all faults of a \
         log."
        "Before the evaluation, faults in the recorded data were repaired or missing information was assumed; U \
         includes the effect."
    NotConverged = "W02" "not-converged" Failed:
        "A parameter was still changing when the iterations ended, so neither the values nor the σ can be used. The \
         usual causes are a wrong scale, unit, sample period or axis in run.toml, or a recording that contains almost \
         no motion. Run `turncal check`, which compares scale, unit and axes with gravity and the turns."
        "The evaluation did not converge; the results must not be used."
    Unexplained = "W03" "unexplained" Failed:
        "The residuals are too large to be explained by any noise figure, so the values are meaningless. The usual \
         causes are labels or table attitudes from a different recording, a wrong axis order, a wrong unit, or a \
         mount that slipped. First look at the interval with the largest residuals, which the finding states."
        "The residuals of the evaluation cannot be explained; the results must not be used."
    NotObserved = "W04" "not-observed" Partial:
        "The recording adds little information about these parameters: each σ is still more than half of the prior σ, \
         so turncal keeps the values and σ of [imu.prior]. Add positions that put each axis up and down, and a turn of \
         90° or more about each axis. `turncal check` predicts the σ of each parameter."
        "For some parameters, the recording adds little to the values that were assumed beforehand."
    CombinationsNotObserved = "W05" "combinations-not-observed" Care:
        "Each of these parameters is determined individually, but a combination of them is not, because their errors \
         compensate in every position of this path. Add positions or turns in which these parameters have different \
         effects. The \
         correlation figure in the report shows which parameters depend on each other."
        "Some parameters are determined only in combination with other parameters; use them together with the \
         covariance matrix."
    HeadingNotObserved = "W06" "heading-not-observed" Note:
        "The gyros do not sense Earth rate well enough to find north. K, E and D can be determined without the \
         heading, but the gyro biases are less accurate because the direction of Earth rate is uncertain. If you need \
         the heading, use a table, or use gyros with noise below 0.1 °/√h and dwells of one minute."
        "The gyroscopes cannot determine the direction of north; U of the gyroscope biases includes the unknown part \
         of Earth rate."
    NoiseLearnt = "W07" "noise-learnt" Care:
        "The noise of this recording is more than 1.5 times as large as a figure in [imu.noise] (false-alarm rate 1 in \
         1000). turncal used its own estimate for the weights and the σ. To state the estimate for the next \
         recording, copy the lines in the finding into run.toml; to use the stated noise anyway, add --noise stated."
        "The noise of the instrument was estimated from the recorded data, because it exceeds the stated noise."
    ScatterAtRest = "W08" "scatter-at-rest" Care:
        "You requested the stated noise, but the scatter of the samples in dwells is larger or smaller than this \
         noise implies. The scatter is computed from 0.1 s averages, so vibration of the mount increases \
         it. Record an hour at rest, run `turncal allan` to \
         separate noise from vibration, and state the result in [imu.noise]."
        "The noise at standstill differs from the noise stated for the instrument."
    Inconsistent = "W10" "inconsistent" Care:
        "The normalised innovation squared (NIS) is outside its 99.9 % interval: the residuals are larger or smaller \
         than predicted. If the residuals are larger only after moves, suspect the table position, a scale factor or a \
         time offset. If the residuals are larger in dwells, suspect bias drift, often due to temperature \
         (--temperature). If the residuals are larger everywhere, suspect the white noise in [imu.noise]."
        "The residuals of the evaluation differ from their expected size by more than chance explains."
    ErrorTermEstimated = "W12" "error-term-estimated" Note:
        "The recording shows a significant error term, so turncal estimated this term together with K, E and \
         D. The values are valid only together with this term: `turncal apply` corrects the error; export formats \
         without error terms leave the error in the data and state this. To leave the term out, list only the terms \
         that you want to estimate after --with."
        "The results apply only together with the error terms listed in this certificate."
    Settling = "W15" "settling" Note:
        "After stops, the attitude differs from the reading of the table by an angle that fades within seconds. \
         turncal estimated the typical magnitude of this angle, and the σ include this error. Wait longer after each \
         stop, or state settling_sigma_arcsec in [turntable]."
        "The turntable settled for some seconds after its moves; U includes the effect."
    PositionWrong = "W16" "position-wrong" Care:
        "The table attitude in one dwell contradicts the gyros and accelerometers. turncal gave the readings of this \
         dwell next to no weight and used the rest. Check the table log at this time for a missed step, a wrong label \
         or a bump."
        "A reading of the turntable was wrong and has practically no weight in the results."
    MoveWrong = "W17" "move-wrong" Care:
        "In one move, the integrated gyro angle differs from the change of attitude. turncal estimated the \
         difference. Check this move for lost samples, a rate beyond the gyro range, or a mount that slipped."
        "The rotation measured in a move was wrong; the error was estimated together with the results."
    BiasStep = "W18" "bias-step" Care:
        "A bias changed permanently between two dwells. turncal estimated this change; the calibration contains the \
         mean bias over the recording. Look for a shock or a change of supply voltage or temperature at that time, and \
         repeat the recording if the bias matters."
        "A bias changed during the calibration; the result is the mean bias over the recording."
    EarthRateWrong = "W19" "earth-rate-wrong" Care:
        "In all attitudes, the gyros sense an Earth rate that does not match the stated latitude. turncal estimated \
         the difference. Check latitude_deg (first its sign), then the north and level of the table."
        "The measured Earth rate differs from the Earth rate at the stated latitude; the difference was estimated \
         together with the results."
    FarFromPrior = "W20" "far-from-prior" Care:
        "Some parameters are many prior σ away from their prior values in [imu.prior]. Either run.toml contains a wrong unit, scale, sign \
         or axis order, or the prior σ are too small for this instrument. The finding lists the likely causes."
        "Some parameters differ from the data sheet by much more than the tolerances in the data sheet allow."
    FormRejected = "W21" "form-rejected" Care:
        "The data need more angles than the chosen misalignment form has. The errors of the values in this form are \
         therefore larger than their σ. Rerun with --installation general."
        "The instrument has misalignments that the chosen model does not contain; U does not include these \
         misalignments."
    Rounded = "W22" "rounded" Care:
        "The log rounds values to steps larger than their noise, so averaging cannot recover the mean within a \
         step. The \
         σ include this error. Log more digits, or log raw counts."
        "The output of the instrument is rounded to steps larger than its noise; U includes the effect."
    EvenTermsInseparable = "W24" "even-terms-inseparable" Care:
        "When an axis points up or down, the second-order term and the asymmetry of its accelerometer have the same \
         effect. Add dwells with axes at about 45°, or switch off one of the two terms."
        "The second-order term and the asymmetry of an accelerometer are determined only as a sum."
    TemperatureNotSeen = "W25" "temperature-not-seen" Care:
        "The recording does not show how these parameters change with temperature, so they are valid only at the \
         recorded temperatures. Record positions and turns at several different temperatures."
        "The change of some parameters with temperature was not measured; the results apply only at the temperature \
         of the calibration."
    RecordingsDiffer = "W26" "recordings-differ" Care:
        "The recordings of this instrument differ by more than their σ and [day_to_day] allow. turncal estimated the \
         difference and included it in the σ. The usual causes are bias changes at switch-on, remounting, and a \
         temperature sensor that is not close to the inertial sensors."
        "The instrument changed between the recordings of the calibration; U includes the difference."
    LabelsContradicted = "W27" "labels-contradicted" Care:
        "The labels of some sections contradict gravity or the gyros. The finding lists these sections, and states \
         whether turncal used them. Correct the labels in the [segments] file."
        "The labels of some positions contradicted the data; these labels were not used."
    SectionsLost = "W28" "sections-lost" Care:
        "turncal skipped a labelled section because rows are missing there. Record this section again, or remove its \
         label from [segments]."
        "Some positions were not used because part of their data was missing."
    ResidualsLarge = "W29" "residuals-large" Care:
        "The closed form leaves residuals that stated noise and table errors do not explain. turncal widened all σ by \
         √(χ²/ν), the Birge ratio. The finding states the interval with the largest residual: look there for a bump, \
         a wrong label or a wrong attitude. If there is no such cause, check the noise figures, drifts of bias or \
         scale factors, and the level and north of the table."
        "The residuals are larger than expected; U was increased in proportion."
    StatementDoubted = "W30" "statement-doubted" Care:
        "run.toml contradicts the log: for example, gravity is far from normal gravity at the site, a column is \
         constant or is named twice, or the table log has a different time or clock. Each of these contradictions can \
         change the result by more than its σ. Correct the field in run.toml, or the log, that the finding names."
        "Some of the information about the recording contradicts its data."
    PriorContradicted = "W31" "prior-contradicted" Failed:
        "A scale factor differs from the stated one by more than 10 prior σ and more than 10 %, or by more than 41 \
         %. The estimate may be the result of a wrong turn angle or a wrong unit. Correct scale, unit or sample_period_s in \
         [imu], or widen scale_sigma_ppm if the sensor really differs that much."
        "A scale factor contradicts its stated value; the results must not be used."
    VelocityWrong = "W32" "velocity-wrong" Care:
        "In one move, the velocity change from the accelerometers has a far larger error than in other moves. turncal \
         estimated this error. Check this move for lost samples, a force beyond the range, or a bump."
        "The acceleration measured in a move was wrong; the error was estimated together with the results."
    Slipped = "W33" "slipped" Care:
        "From one dwell on, all attitudes are rotated by the same angle: the instrument slipped on the table, or the \
         table slipped on the ground. turncal estimated the angle, so scale factors and biases are hardly less \
         accurate; the misalignments refer to the mounting before the slip. Fasten the instrument and the table, and \
         repeat the recording."
        "The instrument slipped on the turntable; the misalignments apply to the mounting before the slip."
    TermNotShown = "W34" "term-not-shown" Note:
        "This recording cannot show an error term that instruments of this class may have, and K, E or D depend on the \
         term. The σ include the typical magnitude of this term. Add the moves listed in the finding, or state in \
         [imu.terms] that the instrument does not have the term: sigma = 0. `--with none` leaves out all terms."
        "U includes the typical magnitude of error terms that the recorded data cannot show."
    FieldDisturbed = "W35" "field-disturbed" Note:
        "In one dwell the magnetic field differs from the field in the other dwells by far more than usual. turncal gave \
         the magnetometer next to no weight in this dwell. Look for steel, a magnet, a motor or a current near the \
         place where the instrument was held."
        "The magnetic field was disturbed in some positions, which have practically no weight in the results."
    FieldVaries = "W36" "field-varies" Care:
        "The magnetic field changes from dwell to dwell by more than 2 % of its magnitude, so it depends on the place \
         where the instrument is held. The σ of the magnetometer include the change. Record outdoors, away from steel \
         and currents, and keep the instrument at one place while you turn it."
        "The magnetic field varied between the positions; U of the magnetometer includes the variation."
    FieldUnlikely = "W37" "field-unlikely" Care:
        "The inclination of the field at the site differs from that of the World Magnetic Model by more than its σ. A \
         building or a vehicle then also changes the magnitude and direction of the field, so the scale factors of the \
         magnetometer are less accurate than stated. Record outdoors, or leave out the date in [meta]."
        "The magnetic field at the site was not that of the Earth; the scale of the magnetometer is less certain."
    MagnetometerNotObserved = "W38" "magnetometer-not-observed" Partial:
        "The dwells do not determine the magnetometer: at least five attitudes are needed whose field directions do not \
         lie in one plane, and they must agree with one field. Add dwells with each axis up and down."
        "The magnetometer was not calibrated, because the positions do not determine it."
    SphereNotCovered = "W39" "sphere-not-covered" Note:
        "A magnetometer was calibrated from its own values, and in some parts of the sphere there are none. The \
         ellipsoid is determined by the other parts. Turn the sensor also so that the field points into the parts that \
         the finding lists: slowly about each axis, then about the axes between them."
        "The magnetometer was not turned into all directions of the field."
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
    fn codes_rise_without_those_that_are_no_longer_given_and_names_are_distinct() {
        const RETIRED: [usize; 5] = [9, 11, 13, 14, 23];
        let numbers = (1..).filter(|number| !RETIRED.contains(number));
        for (number, kind) in numbers.zip(Kind::ALL) {
            assert_eq!(kind.code(), format!("W{number:02}"));
            assert_eq!(Kind::named(kind.name()), Some(*kind));
            assert_eq!(Kind::named(&kind.code().to_lowercase()), Some(*kind));
        }
        let names: BTreeSet<&str> = Kind::ALL.iter().map(|kind| kind.name()).collect();
        assert_eq!(names.len(), Kind::ALL.len());
        assert_eq!(Kind::named("nothing"), None);
    }
}
