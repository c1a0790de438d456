"""Models compared: the protocol's runs -> records and predictions -> rows over seeds -> text, the paper's Table IV."""
