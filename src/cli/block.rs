//! Blocks of states as arguments.

use anyhow::bail;
use clap::ValueEnum;
use clap::builder::PossibleValue;
use turncal::imu::Term;
use turncal::run::{Run, StateBlock};

/// A block of states that a run can switch on.
#[derive(Debug, Clone, Copy)]
pub struct Block(pub StateBlock);

impl ValueEnum for Block {
    fn value_variants<'a>() -> &'a [Self] {
        const ALL: [Block; StateBlock::ALL.len()] = {
            let mut all = [Block(StateBlock::WanderingBias); StateBlock::ALL.len()];
            let mut k = 0;
            while k < all.len() {
                all[k] = Block(StateBlock::ALL[k]);
                k += 1;
            }
            all
        };
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0.name()).help(match self.0 {
            StateBlock::WanderingBias => "Biases that wander during the run",
            StateBlock::TableBase => "Level and north of the table",
            StateBlock::TableAxes => "Axes of the table that are not square",
            StateBlock::Term(Term::AccelSecondOrder) => "Accelerometers: square of specific force",
            StateBlock::Term(Term::AccelAsymmetry) => {
                "Accelerometers: size of specific force, whatever its sign"
            }
            StateBlock::Term(Term::SizeEffect) => "Accelerometers that do not stand in one point",
            StateBlock::Term(Term::TimeOffset) => "Accelerometer samples later than the gyros'",
            StateBlock::Term(Term::GSensitivity) => "Gyros that sense specific force",
        }))
    }
}

impl Block {
    /// Whether it is one of the table's errors.
    pub fn of_table(self) -> bool {
        matches!(self.0, StateBlock::TableBase | StateBlock::TableAxes)
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
