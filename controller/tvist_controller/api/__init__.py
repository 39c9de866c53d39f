"""The controller's public interface for studies and experiments, in modules that load only what they need."""
