"""From raw sessions to labels and what is told of them: process, check, evaluate, survey-landmarks."""
