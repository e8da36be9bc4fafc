//! Ranks: which layer each item of a level goes to, so that most edges run one way.

/// Ranks of `count` items joined by `edges` (pairs of items; an item to itself counts for nothing), from 0 without gaps.
///
/// Cycles are opened where a walk from the first item on, in order, comes back to where it is; the edge that closes the
/// cycle runs backwards. Items without any edge are spread over a square.
pub fn ranks(count: usize, edges: &[(usize, usize)]) -> Vec<usize> {
    let mut next: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut incoming = vec![0usize; count];
    let mut alone = vec![true; count];
    for &(a, b) in edges.iter().filter(|(a, b)| a != b) {
        next[a].push(b);
        incoming[b] += 1;
        alone[a] = false;
        alone[b] = false;
    }
    // A walk from the sources, then from whatever was not reached; finished items come out in reverse order.
    let mut seen = vec![0u8; count];
    let mut order = Vec::with_capacity(count);
    let starts = (0..count).filter(|i| incoming[*i] == 0).chain(0..count);
    let mut forward: Vec<Vec<usize>> = vec![Vec::new(); count];
    for start in starts {
        if seen[start] != 0 {
            continue;
        }
        seen[start] = 1;
        let mut walk = vec![(start, 0usize)];
        while let Some((item, at)) = walk.last_mut() {
            let item = *item;
            if let Some(&to) = next[item].get(*at) {
                *at += 1;
                match seen[to] {
                    0 => {
                        forward[item].push(to);
                        seen[to] = 1;
                        walk.push((to, 0));
                    }
                    1 => forward[to].push(item),
                    _ => forward[item].push(to),
                }
            } else {
                seen[item] = 2;
                order.push(item);
                walk.pop();
            }
        }
    }
    order.reverse();
    let mut rank = vec![0usize; count];
    for &item in &order {
        for &to in &forward[item] {
            rank[to] = rank[to].max(rank[item] + 1);
        }
    }
    // A source stands right before what it leads to, not at the far end.
    let mut has_before = vec![false; count];
    forward.iter().flatten().for_each(|to| has_before[*to] = true);
    for item in 0..count {
        if !has_before[item]
            && let Some(nearest) = forward[item].iter().map(|to| rank[*to]).min()
        {
            rank[item] = nearest.saturating_sub(1);
        }
    }
    let lonely: Vec<usize> = (0..count).filter(|i| alone[*i]).collect();
    #[allow(clippy::cast_sign_loss, clippy::cast_possible_truncation, clippy::cast_precision_loss)]
    let columns = ((lonely.len() as f64).sqrt().ceil() as usize).max(1);
    for (i, item) in lonely.iter().enumerate() {
        rank[*item] = i % columns;
    }
    let mut used: Vec<usize> = rank.clone();
    used.sort_unstable();
    used.dedup();
    rank.iter().map(|r| used.binary_search(r).expect("a used rank")).collect()
}

#[cfg(test)]
mod tests {
    use super::ranks;

    #[test]
    fn chains_cycles_and_lonely_items() {
        assert_eq!(ranks(3, &[(0, 1), (1, 2)]), [0, 1, 2]);
        assert_eq!(ranks(3, &[(0, 1), (1, 2), (2, 0)]), [0, 1, 2]);
        assert_eq!(ranks(4, &[]), [0, 1, 0, 1]);
        assert_eq!(ranks(4, &[(0, 1), (1, 2), (3, 2)]), [0, 1, 2, 1]);
        let long: Vec<(usize, usize)> = (0..100_000).map(|i| (i, i + 1)).collect();
        assert_eq!(ranks(100_001, &long)[100_000], 100_000);
    }
}
