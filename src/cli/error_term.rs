//! Error terms as arguments.

use anyhow::bail;
use clap::ValueEnum;
use clap::builder::PossibleValue;
use clap::error::ErrorKind;
use turncal::calibration::{ErrorTerm, Problem};
use turncal::run;
use turncal::turntable::AxisError;

use super::estimation::Aiding;

/// An error term that a run can switch on: it adds parameters to those estimated.
#[derive(Debug, Clone, Copy)]
pub struct TermArgument(pub ErrorTerm);

impl ValueEnum for TermArgument {
    fn value_variants<'a>() -> &'a [Self] {
        const ALL: [TermArgument; ErrorTerm::ALL.len()] = {
            let mut all = [TermArgument(ErrorTerm::GaussMarkovBias); ErrorTerm::ALL.len()];
            let mut k = 0;
            while k < all.len() {
                all[k] = TermArgument(ErrorTerm::ALL[k]);
                k += 1;
            }
            all
        };
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let value = PossibleValue::new(self.0.name()).help(match self.0 {
            ErrorTerm::GaussMarkovBias => "Gauss–Markov biases",
            ErrorTerm::TableBase => "Level and north of the table",
            ErrorTerm::TableAxes(AxisError::Tilt) => "Non-orthogonality of the table's axes",
            ErrorTerm::TableAxes(AxisError::Wobble) => {
                "Wobble of the table's axes, once and twice a turn"
            }
            ErrorTerm::TableAxes(AxisError::Encoder) => {
                "Errors of the table's encoders, once and twice a turn"
            }
            ErrorTerm::Instrument(term) => term.entry().help,
        });
        Some(match self.0 {
            ErrorTerm::GaussMarkovBias => value.alias("wandering-bias"),
            _ => value,
        })
    }
}

impl TermArgument {
    /// Ends the program, with its status for wrong usage, if this is an error of the table and the table is
    /// not observed.
    pub fn needs_table(self, aiding: Option<Aiding>) {
        let of_table = matches!(self.0, ErrorTerm::TableBase | ErrorTerm::TableAxes(_));
        if of_table && aiding == Some(Aiding::Velocity) {
            let message = format!(
                "--aiding velocity does not observe the table, so {} makes no difference; leave one of them \
                 out\n",
                self.0.name()
            );
            clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
        }
    }

    /// Switches it on in a problem.
    pub fn switch_on(self, problem: &mut Problem) -> anyhow::Result<()> {
        if !problem.model.can_have(self.0) {
            bail!(
                "{}: --with {} needs {}; leave it out, or add that to the run",
                problem.run().recording.name,
                self.0.name(),
                match problem.model.aiding {
                    run::Aiding::Table =>
                        "the angles of the table's axes in the table's log, not a quaternion",
                    run::Aiding::Velocity => "the table's log",
                }
            );
        }
        problem.model.switch_on(self.0);
        Ok(())
    }
}
