//! The paper's five operations and its target game (Funahashi et al. 1998, §5.2) with synthetic hands.

mod drive;
mod probe;
