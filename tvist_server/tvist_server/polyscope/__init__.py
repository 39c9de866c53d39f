"""Programs saved by PolyScope: their translation to URScript, node by node, with PolyScope's labels."""
