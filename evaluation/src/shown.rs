//! Which episodes of an evaluation a page shows: all of a small one; of a large one those that failed and a sample of
//! the others, so that the page's size is bounded.

use offtrack::layout::Ended;
use offtrack::layout::random;

use super::episode::Episode;

/// Most episodes that are all shown: about 15 MB.
pub const MOST_EPISODES: usize = 4000;
/// Most failed episodes shown of a larger evaluation.
pub const MOST_FAILED: usize = 1000;
/// Most others shown of it.
pub const SAMPLE: usize = 400;

/// Indices of the episodes that are shown, in order.
pub fn shown(episodes: &[Episode]) -> Vec<usize> {
    if episodes.len() <= MOST_EPISODES {
        return (0..episodes.len()).collect();
    }
    let (arrived, failed): (Vec<usize>, Vec<usize>) =
        (0..episodes.len()).partition(|&index| episodes[index].ended == Ended::Arrived);
    let mut shown = drawn(&failed, MOST_FAILED);
    shown.extend(drawn(&arrived, SAMPLE));
    shown.sort_unstable();
    shown
}

/// `n` of `items` at most, evenly: one from each of `n` parts of nearly the same size, at random. Equal items give
/// equal draws.
fn drawn(items: &[usize], n: usize) -> Vec<usize> {
    let n = n.min(items.len());
    let one = |part: usize| {
        let [from, to] = [part, part + 1].map(|part| part * items.len() / n);
        let [word, ..] = random::words(0, part as u32, items.len() as u32, n as u32);
        items[from + random::index_below(word, (to - from) as u32) as usize]
    };
    (0..n).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::super::episode::tests::episode;
    use super::*;

    /// Every `one_in`th of `n` episodes failed.
    fn episodes(n: usize, one_in: usize) -> Vec<Episode> {
        let ended = |index: usize| if index.is_multiple_of(one_in) { Ended::TrailerCollided } else { Ended::Arrived };
        (0..n).map(|index| episode(ended(index))).collect()
    }

    #[test]
    fn all_episodes_of_a_small_evaluation_are_shown() {
        assert_eq!(shown(&episodes(MOST_EPISODES, 3)), (0..MOST_EPISODES).collect::<Vec<_>>());
    }

    #[test]
    fn of_a_large_evaluation_all_failed_episodes_are_shown_and_others_from_everywhere() {
        let episodes = episodes(18_000, 30);
        let shown = shown(&episodes);
        let failed = shown.iter().filter(|&&index| episodes[index].ended != Ended::Arrived).count();
        assert_eq!((failed, shown.len() - failed), (600, SAMPLE));
        assert!(shown.is_sorted() && shown.windows(2).all(|pair| pair[0] < pair[1]));
        // 40 of the others for each tenth of the evaluation, but for the one at its border.
        for tenth in 0..10 {
            let within = |&&index: &&usize| index / 1800 == tenth && !index.is_multiple_of(30);
            assert!((39..=41).contains(&shown.iter().filter(within).count()));
        }
        // Not the same episode of each route again and again.
        let numbers: std::collections::BTreeSet<usize> = shown.iter().map(|index| index % 18).collect();
        assert_eq!(numbers.len(), 18);
    }

    #[test]
    fn where_nearly_all_fail_the_number_shown_is_bounded() {
        let episodes: Vec<Episode> = episodes(100_000, 1);
        assert_eq!(shown(&episodes).len(), MOST_FAILED);
    }
}
