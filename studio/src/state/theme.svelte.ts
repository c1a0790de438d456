// Light or dark, as the system has it unless chosen.
const system = matchMedia('(prefers-color-scheme: dark)');

class Theme {
  private wanted = $state<'light' | 'dark' | null>(localStorage.getItem('theme') as 'light' | 'dark' | null);
  private system = $state(system.matches);
  dark = $derived((this.wanted ?? (this.system ? 'dark' : 'light')) === 'dark');

  constructor() {
    system.addEventListener('change', ({ matches }) => (this.system = matches));
  }

  switch(): void {
    this.wanted = this.dark ? 'light' : 'dark';
    localStorage.setItem('theme', this.wanted);
  }
}

export const theme = new Theme();
