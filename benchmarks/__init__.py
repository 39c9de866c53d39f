"""Speed, each figure beside a reference from the same run; part of no distribution."""
