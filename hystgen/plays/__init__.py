"""Plays: the operators as the literature defines them, their memory, and the two engines that compute their sum."""
