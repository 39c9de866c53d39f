"""The controller's public interface for studies, experiments and evaluations; each part loads only what it needs."""
