//! The paper's five operations and its target game (Funahashi et al. 1998, §5.2): each built-in scene with the synthetic
//! hand of its name, at four step rates, from several seeds, right and left, checked on the object's path.

mod demo;
mod drive;
mod flick;
mod free;
mod no_thumb;
mod stack;
mod throw;
