"""What moves: activities, motions by number, streams, guided motions, and the state that they depend on."""
