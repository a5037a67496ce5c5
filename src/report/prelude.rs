//! Common imports of all reports.

pub(super) use serde_json::{Map, Value, json};

pub(super) use super::document::{
    Block, Document, Facts, List, NONE, Table, capital, cells, columns, joined,
};
pub(super) use super::group::{
    Group, axis_name, function_name, group_columns, nominal_scale, short_name, triad_name,
};
pub(super) use super::plot::{
    Anchor, Axis, Color, Dash, Fill, Mark, Panel, Plot, Point, Series, Shape, Upright, beside,
    positive_range, steps,
};
pub(super) use crate::number::*;
pub(super) use crate::units::*;
