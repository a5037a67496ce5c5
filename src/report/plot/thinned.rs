//! Lines of more points than any drawing shows.

use super::point::Point;

/// Points that a line keeps at most; a panel is a hundredth as wide in pixels.
const MOST: usize = 1 << 17;

/// A line of at most as many points as are of use: where there are more, of so many that follow one another the
/// lowest and the highest.
pub(in crate::report) fn thinned(points: impl IntoIterator<Item = Point>) -> Vec<Point> {
    let mut line = Vec::new();
    // Of these, from this place of the line on, two will stay.
    let (mut together, mut begin, mut since) = (1, 0, 0);
    let mut most = MOST;
    for point in points {
        let is_gap = point.0.is_nan() || point.1.is_nan();
        line.push(point);
        since += 1;
        if together > 1 && (since == together || is_gap) {
            let end = line.len() - usize::from(is_gap);
            let ends = lowest_and_highest(&line[begin..end]);
            line.splice(begin..end, ends);
        }
        if since == together || is_gap {
            (begin, since) = (line.len(), 0);
        }
        if line.len() >= most && since == 0 {
            let pieces = line.chunk_by(|a, b| is_finite(a) == is_finite(b));
            let kept = pieces.flat_map(|piece| match is_finite(&piece[0]) {
                true => piece.chunks(4).flat_map(lowest_and_highest).collect(),
                false => piece[..1].to_vec(),
            });
            line = kept.collect();
            // Many gaps stay.
            most = MOST.max(2 * line.len());
            (begin, together) = (line.len(), (2 * together).max(4));
        }
    }
    line
}

fn is_finite(point: &Point) -> bool {
    !point.0.is_nan() && !point.1.is_nan()
}

/// Both in their order; one where there is no other.
fn lowest_and_highest(points: &[Point]) -> Vec<Point> {
    let by_height = |a: &(usize, &Point), b: &(usize, &Point)| a.1.1.total_cmp(&b.1.1);
    let lowest = points.iter().enumerate().min_by(by_height);
    let highest = points.iter().enumerate().max_by(by_height);
    let ends = lowest
        .zip(highest)
        .map(|(low, high)| match low.0.cmp(&high.0) {
            std::cmp::Ordering::Less => vec![*low.1, *high.1],
            std::cmp::Ordering::Equal => vec![*low.1],
            std::cmp::Ordering::Greater => vec![*high.1, *low.1],
        });
    ends.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_keeps_its_extremes_its_gaps_and_its_order_in_few_points() {
        let point = |k: usize| {
            let height = match k {
                700_001 => 50.0,
                2_000_002 => -70.0,
                _ => (k as f64).sin(),
            };
            (k as f64, if k == 1_000_000 { f64::NAN } else { height })
        };
        let line = thinned((0..3_000_000).map(point));
        assert!(
            line.len() <= MOST && line.len() > MOST / 8,
            "{}",
            line.len()
        );
        assert!(line.is_sorted_by(|a, b| a.0 < b.0));
        for extreme in [700_001, 2_000_002] {
            assert!(line.contains(&point(extreme)), "{extreme}");
        }
        assert_eq!(line.iter().filter(|point| point.1.is_nan()).count(), 1);
        // The picture is the same all along: hardly a piece without its own swing.
        let swing =
            |piece: &[Point]| piece.iter().any(|p| p.1 > 0.9) && piece.iter().any(|p| p.1 < -0.9);
        assert!(line.chunks(64).all(swing));
    }

    #[test]
    fn a_short_line_stays_as_it_is() {
        let line: Vec<Point> = (0..1000)
            .map(|k| (f64::from(k), f64::from(k % 7)))
            .collect();
        assert_eq!(thinned(line.iter().copied()), line);
    }
}
