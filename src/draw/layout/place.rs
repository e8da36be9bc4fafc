//! Places inside the layers: as near to the neighbours in other layers as order and size allow.

/// A tie between two vertices in neighbouring layers: `a`'s place plus `a_at` wants to be `b`'s place plus `b_at`.
#[derive(Debug, Clone, Copy)]
pub struct Tie {
    /// A vertex.
    pub a: usize,
    /// Offset from its middle.
    pub a_at: f64,
    /// The other vertex.
    pub b: usize,
    /// Offset from its middle.
    pub b_at: f64,
    /// How much it matters; long edges want to be straight.
    pub weight: f64,
}

/// Middles of all vertices. `layers` in order, `sizes` across, `gap` between two neighbours of a layer.
pub fn place(layers: &[Vec<usize>], sizes: &[f64], gap: impl Fn(usize, usize) -> f64, ties: &[Tie]) -> Vec<f64> {
    let mut at = vec![0.0; sizes.len()];
    let mut layer_of = vec![0usize; sizes.len()];
    let mut rests: Vec<Vec<f64>> = Vec::with_capacity(layers.len());
    for (i, layer) in layers.iter().enumerate() {
        // Least distance of each vertex from the first of its layer.
        let mut sum = 0.0;
        let mut rest = Vec::with_capacity(layer.len());
        for (k, v) in layer.iter().enumerate() {
            if k > 0 {
                let before = layer[k - 1];
                sum += (sizes[before] + sizes[*v]) / 2.0 + gap(before, *v);
            }
            rest.push(sum);
            layer_of[*v] = i;
        }
        let middle = sum / 2.0;
        for (v, r) in layer.iter().zip(&rest) {
            at[*v] = r - middle;
        }
        rests.push(rest);
    }
    let mut tied: Vec<Vec<Tie>> = vec![Vec::new(); sizes.len()];
    for t in ties {
        tied[t.a].push(*t);
        tied[t.b].push(Tie { a: t.b, a_at: t.b_at, b: t.a, b_at: t.a_at, weight: t.weight });
    }
    let rounds = (4_000_000 / (ties.len() + sizes.len() + 1)).clamp(4, 60);
    for round in 0..rounds {
        let downwards = round % 2 == 0;
        // The last rounds look both ways, which settles what the sweeps left leaning.
        let both = round + 12 >= rounds;
        for k in 0..layers.len() {
            let i = if downwards { k } else { layers.len() - 1 - k };
            let wanted: Vec<(f64, f64)> = layers[i]
                .iter()
                .zip(&rests[i])
                .map(|(v, rest)| {
                    let (mut sum, mut weight) = (0.0, 0.0);
                    for t in &tied[*v] {
                        let other = layer_of[t.b];
                        if both || (downwards && other <= i) || (!downwards && other >= i) {
                            sum += (at[t.b] + t.b_at - t.a_at) * t.weight;
                            weight += t.weight;
                        }
                    }
                    if weight > 0.0 { (sum / weight - rest, weight) } else { (at[*v] - rest, 0.01) }
                })
                .collect();
            for ((v, rest), y) in layers[i].iter().zip(&rests[i]).zip(in_order(&wanted)) {
                at[*v] = y + rest;
            }
        }
    }
    at
}

/// The non-decreasing values nearest to the wanted ones (value, weight), in the sense of least squares: neighbours out
/// of order are pooled until none are.
fn in_order(wanted: &[(f64, f64)]) -> Vec<f64> {
    let mut pools: Vec<(f64, f64, usize)> = Vec::with_capacity(wanted.len());
    for (value, weight) in wanted {
        let mut pool = (*value, *weight, 1);
        while let Some(last) = pools.last()
            && last.0 > pool.0
        {
            let last = pools.pop().expect("just seen");
            let weight = last.1 + pool.1;
            pool = ((last.0 * last.1 + pool.0 * pool.1) / weight, weight, last.2 + pool.2);
        }
        pools.push(pool);
    }
    pools.into_iter().flat_map(|(value, _, n)| std::iter::repeat_n(value, n)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pools_are_the_nearest_ordered_values() {
        assert_eq!(in_order(&[(1.0, 1.0), (3.0, 1.0), (2.0, 1.0)]), [1.0, 2.5, 2.5]);
    }

    #[test]
    fn nothing_overlaps() {
        let layers = vec![vec![0], vec![1, 2, 3]];
        let sizes = [10.0, 20.0, 30.0, 40.0];
        let tie = |b| Tie { a: 0, a_at: 0.0, b, b_at: 0.0, weight: 1.0 };
        let at = place(&layers, &sizes, |_, _| 5.0, &[tie(1), tie(2), tie(3)]);
        assert!(at[2] - at[1] >= 30.0 - 1e-9 && at[3] - at[2] >= 40.0 - 1e-9);
    }
}
