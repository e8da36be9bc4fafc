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

/// Middles of all vertices. `layers` in order, `sizes` across, `gap` between two neighbours of a layer. Parts that no tie
/// joins stand one after the other, the largest first.
pub fn place(layers: &[Vec<usize>], sizes: &[f64], gap: impl Fn(usize, usize) -> f64, ties: &[Tie]) -> Vec<f64> {
    let parts = parts(sizes.len(), ties);
    let count = parts.iter().max().map_or(0, |p| p + 1);
    if count <= 1 {
        return place_part(layers, sizes, &gap, ties);
    }
    let mut members = vec![0usize; count];
    parts.iter().for_each(|p| members[*p] += 1);
    // Single vertices share one part: a grid of boxes without edges.
    let group_of = |v: usize| if members[parts[v]] == 1 { count } else { parts[v] };
    let mut order: Vec<usize> = (0..count).filter(|p| members[*p] > 1).collect();
    order.sort_by_key(|p| std::cmp::Reverse(members[*p]));
    order.push(count);
    let mut layers_of: Vec<Vec<Vec<usize>>> = vec![vec![Vec::new(); layers.len()]; count + 1];
    for (i, layer) in layers.iter().enumerate() {
        for v in layer {
            layers_of[group_of(*v)][i].push(*v);
        }
    }
    let mut ties_of: Vec<Vec<Tie>> = vec![Vec::new(); count + 1];
    ties.iter().for_each(|t| ties_of[group_of(t.a)].push(*t));
    let mut at = vec![0.0; sizes.len()];
    let mut next = 0.0;
    for group in order {
        let layers = &layers_of[group];
        let mut own: Vec<usize> = layers.iter().flatten().copied().collect();
        if own.is_empty() {
            continue;
        }
        own.sort_unstable();
        let placed = place_part(layers, sizes, &gap, &ties_of[group]);
        let low = own.iter().map(|v| placed[*v] - sizes[*v] / 2.0).fold(f64::INFINITY, f64::min);
        let high = own.iter().map(|v| placed[*v] + sizes[*v] / 2.0).fold(f64::NEG_INFINITY, f64::max);
        own.iter().for_each(|v| at[*v] = placed[*v] - low + next);
        next += high - low + 26.0;
    }
    at
}

/// The part each vertex belongs to: vertices joined by ties are in one, numbered without gaps.
fn parts(count: usize, ties: &[Tie]) -> Vec<usize> {
    let mut lead: Vec<usize> = (0..count).collect();
    fn find(lead: &mut [usize], mut v: usize) -> usize {
        while lead[v] != v {
            lead[v] = lead[lead[v]];
            v = lead[v];
        }
        v
    }
    for t in ties {
        let (a, b) = (find(&mut lead, t.a), find(&mut lead, t.b));
        lead[a.max(b)] = a.min(b);
    }
    let mut number = vec![usize::MAX; count];
    let mut next = 0;
    (0..count)
        .map(|v| {
            let root = find(&mut lead, v);
            if number[root] == usize::MAX {
                number[root] = next;
                next += 1;
            }
            number[root]
        })
        .collect()
}

fn place_part(layers: &[Vec<usize>], sizes: &[f64], gap: &impl Fn(usize, usize) -> f64, ties: &[Tie]) -> Vec<f64> {
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
