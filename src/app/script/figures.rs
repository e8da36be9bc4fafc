//! Figures: what a script has measured, each with the bounds in which it is expected.

use super::options::OptionFields;
use super::{SharedHost, error};
use crate::limits;
use crate::model::finding::count;
use mlua::{Lua, Table};
use serde::Serialize;

/// One figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it is of.
    pub name: String,
    /// How much it is; in JSON null where it is no finite number.
    pub value: f64,
    /// In which unit.
    pub unit: Option<String>,
    /// At least that is expected.
    pub min: Option<f64>,
    /// At most that is.
    pub max: Option<f64>,
    /// Whether it is as expected.
    pub ok: bool,
    /// When it was told, in seconds of the clock.
    pub at: f64,
    /// In which line of the script: `story.lua:12`.
    pub place: String,
}

impl Figure {
    /// A number of it, with its unit.
    pub fn with_unit(&self, value: f64) -> String {
        let unit = self.unit.as_deref().map_or_else(String::new, |unit| format!(" {unit}"));
        format!("{}{unit}", digits(value))
    }

    /// Its value as a table has it. What is next to nothing beside its bounds, and within them, is 0: what is left there of times and sums that
    /// are not exact in binary is nothing that was measured.
    pub fn shown(&self) -> String {
        self.with_unit(if self.ok { beside(self.value, self.min, self.max) } else { self.value })
    }

    /// What is expected: `at most 0.012 m`; nothing where nothing is.
    pub fn expected(&self) -> String {
        let least = self.min.map(|min| format!("at least {}", self.with_unit(min)));
        let most = self.max.map(|max| format!("at most {}", self.with_unit(max)));
        least.into_iter().chain(most).collect::<Vec<_>>().join(" and ")
    }

    /// What is wrong with it.
    fn missed(&self) -> String {
        format!("{} is {}, expected {}", self.name, self.with_unit(self.value), self.expected())
    }
}

/// Below that share of the larger one of its bounds a value is next to nothing.
const NEXT_TO_NOTHING: f64 = 1e-9;

/// A value that keeps its bounds; 0 where it is next to nothing beside them.
pub fn beside(value: f64, min: Option<f64>, max: Option<f64>) -> f64 {
    let largest = [min, max].into_iter().flatten().map(f64::abs).filter(|bound| bound.is_finite()).fold(0.0, f64::max);
    if value.abs() < NEXT_TO_NOTHING * largest { 0.0 } else { value }
}

/// A number with as many digits as a person compares.
pub fn digits(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        return value.to_string();
    }
    if size != 0.0 && !(1e-4..1e7).contains(&size) {
        return format!("{value:.4e}");
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let behind = if size < 1.0 { 6 } else { (6 - size.log10().floor() as i32).clamp(0, 6) as usize };
    let text = format!("{value:.behind$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Adds a figure; `bounded`: something is expected of it. One that is missed fails the script at its end, a fatal one at once.
pub(super) fn add(host: &SharedHost, lua: &Lua, table: Table, bounded: bool) -> mlua::Result<()> {
    let (function, known): (_, &[&str]) = match bounded {
        true => ("expect", &["name", "value", "min", "max", "unit", "fatal"]),
        false => ("figure", &["name", "value", "unit"]),
    };
    let fields = OptionFields::of(function, Some(table), known)?;
    let name = fields.needed("name", fields.text("name")?, "what the figure is of, such as \"rms error\"")?;
    let value = fields.needed("value", fields.number("value")?, "the number that was measured")?;
    let (min, max) = (fields.number("min")?, fields.number("max")?);
    if bounded && min.is_none() && max.is_none() {
        return Err(error(
            "`expect` needs `min`, `max` or both; what nothing is expected of is `figure{ name = …, value = … }`",
        ));
    }
    if [min, max].into_iter().flatten().any(f64::is_nan) {
        return Err(error("`expect`: a bound is not a number, and nothing would ever keep it"));
    }
    if let (Some(least), Some(most)) = (min, max)
        && least > most
    {
        return Err(error(format!("`expect`: `min` ({least}) is above `max` ({most}): no value could keep both")));
    }
    // What is not a number keeps no bound.
    let within = min.is_none_or(|min| value >= min) && max.is_none_or(|max| value <= max);
    let ok = within && !(bounded && value.is_nan());
    let at = host.borrow().options.clock.now().as_secs_f64();
    let figure = Figure { name, value, unit: fields.text("unit")?, min, max, ok, at, place: place(lua) };
    let missed = (!ok).then(|| figure.missed());
    {
        let mut host = host.borrow_mut();
        if host.figures.len() >= limits::FIGURES {
            return Err(error(format!("a script has at most {}", count(limits::FIGURES, "figure"))));
        }
        if let Some(before) = host.figures.iter().find(|before| before.name == figure.name) {
            let (name, place) = (&figure.name, &before.place);
            return Err(error(format!("there is a figure `{name}` already ({place}): give this one another name")));
        }
        host.figures.push(figure);
    }
    if missed.is_some() {
        super::scene::keep_first(host);
    }
    match missed {
        Some(missed) if fields.flag("fatal").unwrap_or(false) => Err(error(missed)),
        Some(missed) => {
            (host.borrow().options.say)(&format!("missed: {missed}"));
            Ok(())
        }
        None => Ok(()),
    }
}

/// Why the script fails by its figures, if it does.
pub(super) fn failure(figures: &[Figure]) -> Option<String> {
    let missed: Vec<&Figure> = figures.iter().filter(|figure| !figure.ok).collect();
    let bounded = figures.iter().filter(|figure| figure.min.is_some() || figure.max.is_some()).count();
    let first = missed.first()?;
    let lines: String = missed[1..].iter().map(|figure| format!("\n{}: {}", figure.place, figure.missed())).collect();
    let of = format!("{} of {} out of bounds", missed.len(), count(bounded, "figure"));
    Some(format!("{}: {}{lines}\n{of}", first.place, first.missed()))
}

/// The line of the script that is being carried out.
pub(super) fn place(lua: &Lua) -> String {
    // 0 is the function of ours.
    let at = lua.inspect_stack(1, |debug| {
        let source = debug.source();
        Some(format!("{}:{}", source.short_src?, debug.current_line()?))
    });
    at.flatten().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_with_the_digits_that_count() {
        let told = [0.0, 0.0123456789, -1.5, 123.456_789, 1_234_567.8, 1.0e9, 3.2e-7, 70.0, f64::NAN];
        let told = told.map(digits);
        assert_eq!(told, ["0", "0.012346", "-1.5", "123.4568", "1234568", "1.0000e9", "3.2000e-7", "70", "NaN"]);
    }

    #[test]
    fn next_to_nothing_beside_a_bound_is_nothing() {
        let told = |value, min, max| digits(beside(value, min, max));
        assert_eq!(told(7.1e-12, None, Some(5.0)), "0");
        assert_eq!(told(-7.1e-12, Some(-5.0), Some(1e-3)), "0");
        assert_eq!(told(7.1e-12, None, Some(1e-9)), "7.1000e-12", "that is a measurable share of it");
        assert_eq!(told(7.1e-12, Some(0.0), None), "7.1000e-12", "beside 0 nothing is small");
        assert_eq!(told(7.1e-12, None, None), "7.1000e-12");
    }
}
