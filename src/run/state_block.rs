//! Blocks of states that a run switches on, beside scale factors, installation and biases.

use nalgebra::Vector3;

use super::{AXIS_TILTS, Run, TableGeometry};
use crate::imu::{Instability, Noise, PerSensor, Sensor, Term};
use crate::units::ARCSEC;

/// A block of states, each with the 1σ that the run states of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StateBlock {
    /// Biases that wander as Gauss–Markov processes.
    WanderingBias,
    /// Level and north of the table's base.
    TableBase,
    /// Tilts of the table's axes within the outermost.
    TableAxes,
    /// A further term of the instrument.
    Term(Term),
}

/// 1σ of a table's level where nothing better is known, rad.
pub(crate) const USUAL_LEVEL: f64 = 10.0 * ARCSEC;
/// 1σ of its north.
pub(crate) const USUAL_NORTH: f64 = 60.0 * ARCSEC;
/// 1σ of each tilt of its axes.
pub(crate) const USUAL_TILT: f64 = 10.0 * ARCSEC;
/// Correlation time of a wandering bias where nothing better is known, s.
const USUAL_CORRELATION: f64 = 100.0;
/// How many times what white noise averages to in a correlation time a bias then wanders, 1σ.
const USUAL_WANDERING: f64 = 3.0;

impl StateBlock {
    /// Every block.
    pub const ALL: [Self; 8] = [
        Self::WanderingBias,
        Self::TableBase,
        Self::TableAxes,
        Self::Term(Term::AccelSecondOrder),
        Self::Term(Term::AccelAsymmetry),
        Self::Term(Term::SizeEffect),
        Self::Term(Term::TimeOffset),
        Self::Term(Term::GSensitivity),
    ];

    /// The name that files and commands use.
    pub fn name(self) -> &'static str {
        match self {
            Self::WanderingBias => "wandering-bias",
            Self::TableBase => "table-base",
            Self::TableAxes => "table-axes",
            Self::Term(term) => term.name(),
        }
    }

    /// How many states it has.
    pub fn states(self) -> usize {
        match self {
            Self::WanderingBias => 6,
            Self::TableBase => 3,
            Self::TableAxes => AXIS_TILTS,
            Self::Term(term) => term.parameters().len(),
        }
    }
}

impl Noise {
    /// How a bias may wander where nothing better is known than the white noise.
    pub(crate) fn usual_instability(&self) -> Instability {
        Instability {
            sigma: USUAL_WANDERING * self.random_walk / USUAL_CORRELATION.sqrt(),
            correlation_time: USUAL_CORRELATION,
        }
    }
}

impl Run {
    /// Whether a block is on.
    pub fn has(&self, block: StateBlock) -> bool {
        let geometry = self.table.as_ref().map(|table| table.geometry);
        match block {
            StateBlock::WanderingBias => {
                let wanders = |sensor| self.noise.get(sensor).instability.is_some();
                Sensor::ALL.into_iter().any(wanders)
            }
            StateBlock::TableBase => geometry.is_some_and(|g| g.base != Vector3::zeros()),
            StateBlock::TableAxes => geometry.is_some_and(|g| g.axes.amax() > 0.0),
            StateBlock::Term(term) => term.parameters().any(|k| self.further_sigma[k] > 0.0),
        }
    }

    /// Whether the record can hold a block: those of the table need its log, and tilts the angles of
    /// its axes.
    pub fn can_have(&self, block: StateBlock) -> bool {
        match block {
            StateBlock::TableBase => self.table.is_some(),
            StateBlock::TableAxes => self.table.as_ref().is_some_and(|t| !t.tilts.is_empty()),
            StateBlock::WanderingBias | StateBlock::Term(_) => true,
        }
    }

    /// Switches a block on, with its usual σ unless the run states one. Nothing changes where the
    /// record cannot hold it.
    pub fn switch_on(&mut self, block: StateBlock) {
        if self.has(block) || !self.can_have(block) {
            return;
        }
        match block {
            StateBlock::WanderingBias => {
                for noise in [&mut self.noise.gyro, &mut self.noise.accel] {
                    noise.instability = Some(noise.usual_instability());
                }
            }
            StateBlock::TableBase => {
                if let Some(table) = &mut self.table {
                    table.geometry.base = Vector3::new(USUAL_LEVEL, USUAL_LEVEL, USUAL_NORTH);
                }
            }
            StateBlock::TableAxes => {
                if let Some(table) = &mut self.table {
                    let first = table.tilts.first().copied().unwrap_or_default();
                    let seen = |k: usize| first.column(k).norm() > 0.0;
                    let axes = 1 + (0..AXIS_TILTS).filter(|&k| seen(k)).count() / 2;
                    table.geometry.axes = TableGeometry::tilts_of(axes, USUAL_TILT);
                }
            }
            StateBlock::Term(term) => {
                for parameter in term.parameters() {
                    self.further_sigma[parameter] = term.usual_sigma();
                }
            }
        }
    }

    /// Switches a block off.
    pub fn switch_off(&mut self, block: StateBlock) {
        match block {
            StateBlock::WanderingBias => {
                self.noise = PerSensor::from_fn(|sensor| Noise {
                    instability: None,
                    ..*self.noise.get(sensor)
                });
            }
            StateBlock::TableBase => {
                if let Some(table) = &mut self.table {
                    table.geometry.base = Vector3::zeros();
                }
            }
            StateBlock::TableAxes => {
                if let Some(table) = &mut self.table {
                    table.geometry.axes.fill(0.0);
                }
            }
            StateBlock::Term(term) => {
                for parameter in term.parameters() {
                    self.further_sigma[parameter] = 0.0;
                }
            }
        }
    }
}
