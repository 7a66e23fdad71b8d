//! Ways of moving (model §5 and §6), one per file. All are functions of poses and displacements.

/// Two or more contacts that make a grasp: the object follows the hand.
pub mod grasp;
/// No contact: inertia and gravity.
pub mod inertia;
/// One contact: translation and rotation from one displacement.
pub mod push;
