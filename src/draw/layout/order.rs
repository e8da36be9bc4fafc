//! Order inside the layers: neighbours near each other, so that few edges cross.

/// A part of an edge between two neighbouring layers, with where it leaves each end (0 … 1 of the vertex' width).
#[derive(Debug, Clone, Copy)]
pub struct Segment {
    /// The vertex in the earlier layer.
    pub upper: usize,
    /// Where on it.
    pub upper_at: f64,
    /// The vertex in the later layer.
    pub lower: usize,
    /// Where on it.
    pub lower_at: f64,
}

/// Sorts every layer (lists of vertices) so that few of `segments` cross. `beside` are pairs in one layer that want to
/// be near each other.
pub fn order(layers: &mut [Vec<usize>], count: usize, segments: &[Segment], beside: &[(usize, usize)]) {
    let mut up: Vec<Vec<(usize, f64, f64)>> = vec![Vec::new(); count];
    let mut down: Vec<Vec<(usize, f64, f64)>> = vec![Vec::new(); count];
    for s in segments {
        down[s.upper].push((s.lower, s.lower_at, s.upper_at));
        up[s.lower].push((s.upper, s.upper_at, s.lower_at));
    }
    let mut near: Vec<Vec<usize>> = vec![Vec::new(); count];
    for &(a, b) in beside {
        near[a].push(b);
        near[b].push(a);
    }
    let mut layer_of = vec![0usize; count];
    let mut place = vec![0.0f64; count];
    for (i, layer) in layers.iter().enumerate() {
        for (at, v) in layer.iter().enumerate() {
            layer_of[*v] = i;
            #[allow(clippy::cast_precision_loss)]
            {
                place[*v] = at as f64;
            }
        }
    }
    let mut by_layer: Vec<Vec<Segment>> = vec![Vec::new(); layers.len()];
    for s in segments {
        by_layer[layer_of[s.upper]].push(*s);
    }
    let crossings = |place: &[f64]| -> usize { by_layer.iter().map(|s| count_crossings(s, place)).sum() };
    let mut best = layers.to_vec();
    let mut fewest = crossings(&place);
    // Work is bounded, so that a diagram of ten thousand components is plain rather than late.
    let rounds = (2_000_000 / (segments.len() + count + 1)).clamp(2, 24);
    for round in 0..rounds {
        if fewest == 0 {
            break;
        }
        let downwards = round % 2 == 0;
        let indices: Vec<usize> =
            if downwards { (0..layers.len()).collect() } else { (0..layers.len()).rev().collect() };
        for i in indices {
            let mut keyed: Vec<(f64, usize)> = layers[i]
                .iter()
                .map(|v| {
                    let from = if downwards { &up[*v] } else { &down[*v] };
                    let mut sum: f64 = from.iter().map(|(n, at, own)| place[*n] + at - own * 0.5).sum();
                    #[allow(clippy::cast_precision_loss)]
                    let mut weight = from.len() as f64;
                    for n in &near[*v] {
                        sum += (place[*n] + 0.5) * 0.5;
                        weight += 0.5;
                    }
                    (if weight > 0.0 { sum / weight } else { place[*v] }, *v)
                })
                .collect();
            keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
            #[allow(clippy::cast_precision_loss)]
            for (at, (_, v)) in keyed.iter().enumerate() {
                place[*v] = at as f64;
            }
            layers[i] = keyed.into_iter().map(|(_, v)| v).collect();
        }
        let now = crossings(&place);
        if now < fewest {
            fewest = now;
            best = layers.to_vec();
        }
    }
    layers.clone_from_slice(&best);
}

/// Crossings among segments between two layers, by counting inversions.
fn count_crossings(segments: &[Segment], place: &[f64]) -> usize {
    let mut ends: Vec<(f64, f64)> =
        segments.iter().map(|s| (place[s.upper] + s.upper_at * 0.9, place[s.lower] + s.lower_at * 0.9)).collect();
    ends.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut lower: Vec<f64> = ends.iter().map(|e| e.1).collect();
    let mut buffer = lower.clone();
    inversions(&mut lower, &mut buffer)
}

/// Pairs out of order in `values`, which end up sorted.
fn inversions(values: &mut [f64], buffer: &mut [f64]) -> usize {
    let n = values.len();
    if n < 2 {
        return 0;
    }
    let (left, right) = values.split_at_mut(n / 2);
    let mut count = inversions(left, &mut buffer[..n / 2]) + inversions(right, &mut buffer[n / 2..]);
    let (mut i, mut j) = (0, 0);
    for slot in buffer.iter_mut() {
        if j >= right.len() || (i < left.len() && left[i] <= right[j]) {
            *slot = left[i];
            i += 1;
        } else {
            count += left.len() - i;
            *slot = right[j];
            j += 1;
        }
    }
    values.copy_from_slice(buffer);
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crossing_is_undone() {
        let segment = |upper, lower| Segment { upper, upper_at: 0.5, lower, lower_at: 0.5 };
        let mut layers = vec![vec![0, 1], vec![2, 3]];
        let segments = [segment(0, 3), segment(1, 2)];
        assert_eq!(count_crossings(&segments, &[0.0, 1.0, 0.0, 1.0]), 1);
        order(&mut layers, 4, &segments, &[]);
        let at = |v| layers.iter().find_map(|l| l.iter().position(|x| *x == v)).unwrap();
        assert_eq!(at(0) < at(1), at(3) < at(2));
    }
}
