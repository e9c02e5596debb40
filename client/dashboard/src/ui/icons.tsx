/** Icons drawn on a grid of 16. They are decoration: whatever carries one also carries words. */

function Icon({ path, fill = false }: { path: string; fill?: boolean }) {
  return (
    <svg class={fill ? "icon icon-fill" : "icon"} viewBox="0 0 16 16" width="16" height="16" aria-hidden="true">
      <path d={path} />
    </svg>
  );
}

export const PlayIcon = () => <Icon fill path="M4.500 2.800v10.400a.6.6 0 0 0 .92.5l8-5.200a.6.6 0 0 0 0-1l-8-5.200a.6.6 0 0 0-.92.500z" />;
export const PauseIcon = () => <Icon fill path="M4 2.500h2.600v11H4zM9.400 2.500H12v11H9.400z" />;
export const HoldIcon = () => <Icon path="M8 1.500v13M2.400 4.750l11.200 6.500M13.600 4.750l-11.200 6.500" />;
export const PulseIcon = () => <Icon path="M1 12.500h3.200c1 0 1.200-9.500 2.300-9.500s1.300 9.500 2.300 9.500h.8c.8 0 1-4.500 1.700-4.500s.9 4.500 1.700 4.500h2" />;
