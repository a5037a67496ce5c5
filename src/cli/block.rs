//! Blocks of states as arguments.

use anyhow::bail;
use clap::ValueEnum;
use clap::builder::PossibleValue;
use turncal::calibration::{ErrorTerm, Problem};
use turncal::imu::Term;
use turncal::run::Aiding;

/// A block of states that a run can switch on.
#[derive(Debug, Clone, Copy)]
pub struct Block(pub ErrorTerm);

impl ValueEnum for Block {
    fn value_variants<'a>() -> &'a [Self] {
        const ALL: [Block; ErrorTerm::ALL.len()] = {
            let mut all = [Block(ErrorTerm::BiasVariation); ErrorTerm::ALL.len()];
            let mut k = 0;
            while k < all.len() {
                all[k] = Block(ErrorTerm::ALL[k]);
                k += 1;
            }
            all
        };
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0.name()).help(match self.0 {
            ErrorTerm::BiasVariation => "Biases that wander during the run",
            ErrorTerm::TableBase => "Level and north of the table",
            ErrorTerm::TableAxes => "Axes of the table that are not square",
            ErrorTerm::Instrument(Term::AccelSecondOrder) => {
                "Accelerometers: square of specific force"
            }
            ErrorTerm::Instrument(Term::AccelAsymmetry) => {
                "Accelerometers: size of specific force, whatever its sign"
            }
            ErrorTerm::Instrument(Term::SizeEffect) => {
                "Accelerometers that do not stand in one point"
            }
            ErrorTerm::Instrument(Term::TimeOffset) => {
                "Accelerometer samples later than the gyros'"
            }
            ErrorTerm::Instrument(Term::GSensitivity) => "Gyros that sense specific force",
        }))
    }
}

impl Block {
    /// Whether it is one of the table's errors.
    pub fn of_table(self) -> bool {
        matches!(self.0, ErrorTerm::TableBase | ErrorTerm::TableAxes)
    }

    /// Switches it on in a problem.
    pub fn switch_on(self, problem: &mut Problem) -> anyhow::Result<()> {
        if !problem.model.can_have(self.0) {
            bail!(
                "{}: --with {} needs {}; leave it out, or add that to the run",
                problem.run().recording.name,
                self.0.name(),
                match problem.model.aiding {
                    Aiding::Table =>
                        "the angles of the table's axes in the table's log, not a quaternion",
                    Aiding::Velocity => "the table's log",
                }
            );
        }
        problem.model.switch_on(self.0);
        Ok(())
    }
}
