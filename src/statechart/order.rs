//! The order of a node's outgoing transitions: rFSM sorts them by priority with Lua's `table.sort`, which is not stable,
//! so with four and more of equal priority the result is not the written order. Which of two transitions wins depends on
//! it; so we sort in exactly the same steps (identical in Lua 5.1, LuaJIT and 5.4 for lists of up to 100; beyond, newer
//! Luas draw a pivot at random and we go on as before).

/// How often a long list is gone through at most; a list that gives no trouble needs twice the logarithm of its length.
const ROUNDS: usize = 64;

/// Sorts `list` so that higher `priority` comes first, in Lua's order.
pub fn sort<T>(list: &mut [T], priority: impl Fn(&T) -> f64) {
    // Lists that keep Lua busy for ever are beyond those whose order is the same in all Luas: there any order of equals will do.
    let mut left = if list.len() <= 100 { usize::MAX } else { list.len() * ROUNDS };
    let before = |a: &T, b: &T| priority(a) > priority(b);
    part(list, &before, &mut left);
    if left == 0 {
        list.sort_by(|a, b| priority(b).partial_cmp(&priority(a)).unwrap_or(std::cmp::Ordering::Equal));
    }
}

fn part<T>(mut a: &mut [T], before: &impl Fn(&T, &T) -> bool, left_over: &mut usize) {
    while a.len() > 1 {
        // Each round looks at every element about once.
        *left_over = left_over.saturating_sub(a.len());
        if *left_over == 0 {
            return;
        }
        let last = a.len() - 1;
        if before(&a[last], &a[0]) {
            a.swap(0, last);
        }
        if last == 1 {
            return;
        }
        // The middle of the 1-based range [l, u], rounded down, is index `last / 2` here.
        let middle = last / 2;
        if before(&a[middle], &a[0]) {
            a.swap(middle, 0);
        } else if before(&a[last], &a[middle]) {
            a.swap(middle, last);
        }
        if last == 2 {
            return;
        }
        let pivot = last - 1;
        a.swap(middle, pivot);
        let (mut i, mut j) = (0, pivot);
        loop {
            i += 1;
            while i < pivot && before(&a[i], &a[pivot]) {
                i += 1;
            }
            j -= 1;
            while j > 0 && before(&a[pivot], &a[j]) {
                j -= 1;
            }
            if j < i {
                break;
            }
            a.swap(i, j);
        }
        a.swap(pivot, i);
        // The smaller side first, the larger one in the next turn.
        let (left, right) = a.split_at_mut(i);
        let right = &mut right[1..];
        if left.len() < right.len() {
            part(left, before, left_over);
            a = right;
        } else {
            part(right, before, left_over);
            a = left;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::sort;

    fn sorted(priorities: &[f64]) -> Vec<usize> {
        let mut list: Vec<usize> = (1..=priorities.len()).collect();
        sort(&mut list, |i| priorities[i - 1]);
        list
    }

    #[test]
    fn the_order_that_lua_gives() {
        assert_eq!(sorted(&[0.0; 4]), [1, 3, 2, 4]);
        assert_eq!(sorted(&[0.0; 5]), [1, 4, 3, 2, 5]);
        assert_eq!(sorted(&[0.0; 7]), [1, 5, 6, 4, 2, 3, 7]);
        assert_eq!(sorted(&[0.0; 12]), [1, 8, 7, 9, 10, 11, 6, 4, 5, 2, 3, 12]);
        assert_eq!(sorted(&[0.0, 5.0, 0.0, 5.0, 0.0, -1.0, 5.0, 0.0]), [4, 2, 7, 5, 1, 8, 3, 6]);
        assert_eq!(sorted(&[-1.0, -1.0, 2.0]), [3, 2, 1]);
    }

    #[test]
    fn always_by_falling_priority() {
        for length in 0..60_u32 {
            let priorities: Vec<f64> = (0..length).map(|i| f64::from(i * 7 % 5)).collect();
            let order = sorted(&priorities);
            assert!(order.windows(2).all(|w| priorities[w[0] - 1] >= priorities[w[1] - 1]), "{length}: {order:?}");
        }
    }

    /// Priorities on which Lua's sort takes a square of their number: an adversary answers its comparisons so that it learns
    /// as little as can be (McIlroy, "A Killer Adversary for Quicksort").
    fn killer(count: usize) -> Vec<f64> {
        let unknown = count as f64;
        let values = std::cell::RefCell::new(vec![unknown; count]);
        let (known, candidate) = (std::cell::Cell::new(0.0), std::cell::Cell::new(0));
        let before = |a: &usize, b: &usize| {
            let mut values = values.borrow_mut();
            if values[*a] == unknown && values[*b] == unknown {
                let which = if *a == candidate.get() { *a } else { *b };
                values[which] = known.get();
                known.set(known.get() + 1.0);
            }
            if values[*a] == unknown {
                candidate.set(*a);
            } else if values[*b] == unknown {
                candidate.set(*b);
            }
            values[*a] < values[*b]
        };
        let mut list: Vec<usize> = (0..count).collect();
        super::part(&mut list, &before, &mut usize::MAX.clone());
        // The highest goes first here.
        values.into_inner().into_iter().map(|value| -value).collect()
    }

    #[test]
    fn no_list_takes_long() {
        let counted = |priorities: &[f64], bound: usize| {
            let count = std::cell::Cell::new(0_usize);
            let mut list: Vec<usize> = (0..priorities.len()).collect();
            let before = |a: &usize, b: &usize| {
                count.set(count.get() + 1);
                priorities[*a] > priorities[*b]
            };
            super::part(&mut list, &before, &mut bound.clone());
            count.get()
        };
        let (count, long) = (4_000, killer(4_000));
        assert!(counted(&long, usize::MAX) > count * count / 16, "{}", counted(&long, usize::MAX));
        assert!(counted(&long, count * super::ROUNDS) < count * (super::ROUNDS + 1));
        let mut list: Vec<usize> = (0..count).collect();
        sort(&mut list, |i| long[*i]);
        assert!(list.windows(2).all(|pair| long[pair[0]] >= long[pair[1]]));
    }
}
