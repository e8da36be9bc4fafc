//! The points of a grid: every combination of the values that parameters take.

use crate::cli::CommandFailure;
use crate::limits;
use crate::model::codes::CLI_BAD_SET;

/// A parameter with the values that it takes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GridAxis {
    /// Its name.
    pub name: String,
    /// The values, as they are given to a run.
    pub values: Vec<String>,
}

fn wrong(text: &str, why: &str) -> CommandFailure {
    let help = "write `--set K=70,150,300`, or `--set delay=0:0.05:0.005` for 0 to 0.05 in steps of 0.005";
    CommandFailure::usage(CLI_BAD_SET, format!("`--set {text}`: {why}"), help)
}

/// The axes that `--set` gives.
///
/// # Errors
/// When one is not written so, is given twice, or there are too many points.
pub fn axes(set: &[String]) -> Result<Vec<GridAxis>, CommandFailure> {
    let mut axes: Vec<GridAxis> = Vec::new();
    let mut points = 1_usize;
    for text in set {
        let Some((name, values)) = text.split_once('=').filter(|(name, _)| !name.trim().is_empty()) else {
            return Err(wrong(text, "it gives no parameter a value"));
        };
        let name = name.trim().to_owned();
        if axes.iter().any(|axis| axis.name == name) {
            return Err(wrong(text, "this parameter has its values already"));
        }
        let mut all = Vec::new();
        for value in values.split(',') {
            all.extend(range(value).map_err(|why| wrong(text, why))?);
        }
        points = points.saturating_mul(all.len());
        if points > limits::SWEEP_POINTS {
            return Err(wrong(text, &format!("that is more than {} points in all", limits::SWEEP_POINTS)));
        }
        axes.push(GridAxis { name, values: all });
    }
    Ok(axes)
}

/// One value as it stands, or those from one number to another in steps.
fn range(text: &str) -> Result<Vec<String>, &'static str> {
    let text = text.trim();
    if text.is_empty() {
        return Err("a value is missing");
    }
    let parts: Vec<&str> = text.split(':').collect();
    let [from, to, step] = parts[..] else { return Ok(vec![text.to_owned()]) };
    let number = |text: &str| text.trim().parse().ok().filter(|number: &f64| number.is_finite());
    let (Some(from), Some(to), Some(step)) = (number(from), number(to), number(step)) else {
        return Err("a range is written FROM:TO:STEP, three numbers");
    };
    // Where the end is missed by rounding alone it is meant.
    let steps = ((to - from) / step + 1e-9).floor();
    if step == 0.0 || !steps.is_finite() || steps < 0.0 {
        return Err("the step leads nowhere near the end");
    }
    if steps >= 1e6 {
        return Err("the step is too small");
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let count = steps as u32;
    // 3 times 0.1 is meant as 0.3.
    let value = |at: u32| ((from + step * f64::from(at)) * 1e12).round() / 1e12;
    Ok((0..=count).map(|at| value(at).to_string()).collect())
}

/// All points, the last axis fastest: of each the values in the order of the axes.
pub fn points(axes: &[GridAxis]) -> Vec<Vec<&str>> {
    axes.iter().fold(vec![Vec::new()], |points, axis| {
        let with = |point: &Vec<_>, value| point.iter().copied().chain([value]).collect();
        let each =
            |point: Vec<_>| axis.values.iter().map(move |value| with(&point, value.as_str())).collect::<Vec<_>>();
        points.into_iter().flat_map(each).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<String> {
        axes(&[text.to_owned()]).unwrap().remove(0).values
    }

    #[test]
    fn lists_and_ranges() {
        assert_eq!(values("K=70, 150,soft"), ["70", "150", "soft"]);
        assert_eq!(values("d=0:0.3:0.1"), ["0", "0.1", "0.2", "0.3"]);
        assert_eq!(values("d=0.05:0:-0.02,1"), ["0.05", "0.03", "0.01", "1"]);
        assert_eq!(values("d=1:1:1"), ["1"]);
        assert_eq!(values("t=10:30"), ["10:30"], "what is no range is a text");
        for text in ["K", "=1", "K=", "K=1,,2", "K=0:1:0", "K=0:1:-1", "K=a:1:1", "K=0:1:1e-9", "K=0:100000:1"] {
            assert!(axes(&[text.to_owned()]).is_err(), "{text}");
        }
        assert!(axes(&["K=1".to_owned(), "K=2".to_owned()]).is_err());
    }

    #[test]
    fn the_last_axis_is_the_fastest() {
        let axes = axes(&["a=1,2".to_owned(), "b=x,y".to_owned()]).unwrap();
        assert_eq!(points(&axes), [["1", "x"], ["1", "y"], ["2", "x"], ["2", "y"]]);
        assert_eq!(points(&[]), [Vec::<&str>::new()]);
    }
}
