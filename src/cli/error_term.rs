//! Error terms as arguments.

use anyhow::bail;
use clap::ValueEnum;
use clap::builder::PossibleValue;
use clap::error::ErrorKind;
use turncal::imu::Term;
use turncal::run::{Run, StateBlock};

use super::calibrate::Aiding;

/// An error term that a run can switch on: it adds parameters to those estimated.
#[derive(Debug, Clone, Copy)]
pub struct ErrorTerm(pub StateBlock);

impl ValueEnum for ErrorTerm {
    fn value_variants<'a>() -> &'a [Self] {
        const ALL: [ErrorTerm; StateBlock::ALL.len()] = {
            let mut all = [ErrorTerm(StateBlock::WanderingBias); StateBlock::ALL.len()];
            let mut k = 0;
            while k < all.len() {
                all[k] = ErrorTerm(StateBlock::ALL[k]);
                k += 1;
            }
            all
        };
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0.name()).help(match self.0 {
            StateBlock::WanderingBias => "Gauss–Markov biases",
            StateBlock::TableBase => "Level and north of the table",
            StateBlock::TableAxes => "Non-orthogonality of the table's axes",
            StateBlock::Term(Term::AccelSecondOrder) => "Accelerometers: square of specific force",
            StateBlock::Term(Term::AccelAsymmetry) => "Accelerometers: magnitude of specific force",
            StateBlock::Term(Term::SizeEffect) => "Accelerometers: lever arms between the three",
            StateBlock::Term(Term::TimeOffset) => {
                "Accelerometers: delay of their samples behind the gyros'"
            }
            StateBlock::Term(Term::GSensitivity) => "Gyros: sensitivity to specific force",
        }))
    }
}

impl ErrorTerm {
    /// Ends the program, with its status for wrong usage, if this is an error of the table and the table is
    /// not observed.
    pub fn needs_table(self, aiding: Option<Aiding>) {
        let of_table = matches!(self.0, StateBlock::TableBase | StateBlock::TableAxes);
        if of_table && aiding == Some(Aiding::Velocity) {
            let message = format!(
                "--aiding velocity does not observe the table, so {} makes no difference; leave one of them \
                 out\n",
                self.0.name()
            );
            clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
        }
    }

    /// Switches it on in a run.
    pub fn switch_on(self, run: &mut Run) -> anyhow::Result<()> {
        if !run.can_have(self.0) {
            bail!(
                "{}: --with {} needs {}; leave it out, or add that to the run",
                run.name,
                self.0.name(),
                match run.table {
                    Some(_) =>
                        "the angles of the table's axes in the table's log, not a quaternion",
                    None => "the table's log",
                }
            );
        }
        run.switch_on(self.0);
        Ok(())
    }
}
