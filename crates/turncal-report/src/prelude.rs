//! Common imports of all reports.

pub use serde_json::{Map, Value, json};

pub use super::document::{Block, Document, Facts, List, NONE, Table, capital, columns, joined};
pub use super::group::{
    Group, axis_name, duration, function_name, group_columns, nominal_scale, several, short_name,
    signed_axis, triad_name,
};
pub use super::plot::{
    Anchor, Axis, Color, Mark, Panel, Plot, Point, Series, beside, positive_range, steps,
};
pub(crate) use crate::document::cells;
pub use turncal::number::*;
pub use turncal::units::*;
