//! Options of all path commands: instrument, table and site, error terms, specification.

use std::path::{Path, PathBuf};

use crate::arguments::{AIDINGS, With, needs_table, one_of, with_value};
use turncal::lot::Specification;
use turncal::models::{ModelError, specification};
use turncal::run::Aiding;
use turncal::study::path::Named;

/// Options of all path commands.
#[derive(Debug, clap::Args)]
pub struct Setting {
    /// Scenario that provides the site, rate, instrument and table [default: demo; by hand: mems]
    #[arg(long, value_name = "SCENARIO")]
    pub scenario: Option<String>,
    /// Instrument to use instead of the scenario's instrument: a TOML file or an embedded name
    #[arg(long, value_name = "MODEL")]
    pub imu: Option<String>,
    /// Table to use instead of the scenario's table: a TOML file or an embedded name
    #[arg(long, value_name = "MODEL")]
    pub table: Option<String>,
    /// The sensor is turned by hand, without a table
    #[arg(long, conflicts_with = "table")]
    pub hand: bool,
    /// Observations used by the filter [default: table; by hand: velocity]
    #[arg(long, value_parser = one_of(&AIDINGS))]
    pub aiding: Option<Aiding>,
    /// Error terms to estimate. auto: average over each term being absent or having one of its usual sizes; none: only
    /// K, E and D; or names of terms that are always estimated [default: auto]
    #[arg(long, value_name = "TERM", value_parser = with_value(), value_delimiter = ',')]
    pub with: Vec<With>,
    /// Specification; turncal tests whether the predicted σ are small enough to decide pass or fail
    #[arg(long, value_name = "FILE")]
    pub specification: Option<PathBuf>,
}

impl Setting {
    /// The names of the models, with a path.
    pub fn named<'a>(&'a self, path: &'a str) -> Named<'a> {
        Named {
            path,
            scenario: self.scenario.as_deref(),
            imu: self.imu.as_deref(),
            table: self.table.as_deref(),
            by_hand: self.hand,
            aiding: self.aiding,
            terms: With::terms(&self.with).collect(),
        }
    }

    /// The specification, if there is one.
    pub fn limits(&self) -> Result<Option<Specification>, ModelError> {
        self.specification.as_deref().map(specification).transpose()
    }

    /// Exits with the wrong-usage status if an error term needs a table and there is none.
    pub fn check_terms(&self, aiding: Option<Aiding>) {
        With::terms(&self.with).for_each(|term| needs_table(term, aiding));
    }

    /// Files among the inputs.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let names = [&self.scenario, &self.imu, &self.table]
            .into_iter()
            .flatten();
        names.map(Path::new).chain(self.specification.as_deref())
    }
}
