//! Sets of object ids, one bit each.

/// A set of ids; as many words as its largest member needs, or as the GPU's buffer has.
#[derive(Clone, Debug, Default)]
pub struct IdSet {
    words: Vec<u32>,
}

impl IdSet {
    /// The set in a GPU buffer of one bit per object.
    pub fn from_words(words: Vec<u32>) -> Self {
        Self { words }
    }

    /// One bit per id.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Whether `id` is a member.
    pub fn contains(&self, id: u32) -> bool {
        self.words
            .get(id as usize / 32)
            .is_some_and(|word| word >> (id % 32) & 1 == 1)
    }

    /// Number of members.
    pub fn len(&self) -> usize {
        self.words
            .iter()
            .map(|word| word.count_ones() as usize)
            .sum()
    }

    /// No members.
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|&word| word == 0)
    }

    /// The members, ascending.
    pub fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        hroc_runtime::readback::members_of(&self.words)
    }

    /// The first `count` members.
    pub fn first(&self, count: u32) -> Self {
        self.iter().take(count as usize).collect()
    }

    /// Members of either.
    pub fn union(&self, other: &Self) -> Self {
        self.combine(other, |a, b| a | b)
    }

    /// Members of both.
    pub fn intersection(&self, other: &Self) -> Self {
        self.combine(other, |a, b| a & b)
    }

    /// Members that `other` lacks.
    pub fn minus(&self, other: &Self) -> Self {
        self.combine(other, |a, b| a & !b)
    }

    fn combine(&self, other: &Self, op: impl Fn(u32, u32) -> u32) -> Self {
        let word = |set: &Self, i: usize| set.words.get(i).copied().unwrap_or(0);
        let len = self.words.len().max(other.words.len());
        Self {
            words: (0..len)
                .map(|i| op(word(self, i), word(other, i)))
                .collect(),
        }
    }
}

impl FromIterator<u32> for IdSet {
    /// The caller vouches for the ids' size: the set takes one bit for each up to the largest.
    fn from_iter<I: IntoIterator<Item = u32>>(ids: I) -> Self {
        let mut set = Self::default();
        for id in ids {
            let word = id as usize / 32;
            if set.words.len() <= word {
                set.words.resize(word + 1, 0);
            }
            set.words[word] |= 1 << (id % 32);
        }
        set
    }
}

impl PartialEq for IdSet {
    fn eq(&self, other: &Self) -> bool {
        self.minus(other).is_empty() && other.minus(self).is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn set_algebra() {
        let a: IdSet = [1, 31, 32, 500].into_iter().collect();
        let b = IdSet::from_words(vec![0x8000_0000, 0, 1]);
        assert_eq!(a.len(), 4);
        assert_eq!(a.iter().collect::<Vec<_>>(), [1, 31, 32, 500]);
        assert_eq!(a.intersection(&b), [31].into_iter().collect());
        assert_eq!(a.minus(&b), [1, 32, 500].into_iter().collect());
        assert_eq!(a.union(&b).len(), 5);
        assert!(b.contains(64) && !b.contains(65) && !b.contains(u32::MAX));
        assert!(IdSet::default().is_empty() && a != b);
    }
}
