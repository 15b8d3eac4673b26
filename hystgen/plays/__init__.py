"""Plays: the operators of the literature, their memory, and the two engines that compute their sum."""
